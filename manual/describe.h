// A program tells its own options and commands: manual pages and completions are made of them when it is built.
#pragma once

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace manual {

inline std::string toJson(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    std::array<char, 8> code{};
    if (letter == '"' || letter == '\\') result += '\\';
    if (static_cast<unsigned char>(letter) < 0x20) std::snprintf(code.data(), code.size(), "\\u%04x", letter);
    result += code[0] != '\0' ? code.data() : std::string(1, letter);
  }
  return result + '"';
}

inline std::string toJson(const CLI::Option& option) {
  std::string names, excluded;
  for (const std::string& name : option.get_snames()) names += (names.empty() ? "" : ",") + toJson("-" + name);
  for (const std::string& name : option.get_lnames()) names += (names.empty() ? "" : ",") + toJson("--" + name);
  for (const CLI::Option* one : option.get_excludes())
    excluded += (excluded.empty() ? "" : ",") + toJson(one->get_name());
  const bool isFlag = option.get_items_expected_max() == 0;
  return R"({"names":[)" + names + R"(],"operand":)" + toJson(option.get_positional() ? option.get_name(true) : "") +
         R"(,"value":)" + toJson(isFlag ? "" : option.get_type_name()) + R"(,"default":)" +
         toJson(option.get_default_str()) + R"(,"required":)" + (option.get_required() ? "true" : "false") +
         R"(,"many":)" + (option.get_items_expected_max() > 1 ? "true" : "false") + R"(,"excludes":[)" + excluded +
         R"(],"help":)" + toJson(option.get_description()) + "}";
}

/// Itself and its commands, and theirs. What --help does not show is left out.
inline std::string toJson(const CLI::App& app) {
  std::string options, commands;
  for (const CLI::Option* one : app.get_options([](const CLI::Option* any) { return !any->get_group().empty(); })) {
    options += (options.empty() ? "" : ",\n") + toJson(*one);
  }
  for (const CLI::App* one : app.get_subcommands([](const CLI::App* any) { return !any->get_group().empty(); })) {
    commands += (commands.empty() ? "" : ",\n") + toJson(*one);
  }
  return R"({"name":)" + toJson(app.get_name()) + R"(,"help":)" + toJson(app.get_description()) + R"(,"footer":)" +
         toJson(app.get_footer()) + R"(,"inherits":)" + (app.get_fallthrough() ? "true" : "false") + R"(,"options":[)" +
         options + "],\n\"commands\":[" + commands + "]}";
}

/// Adds a flag that --help does not show: it prints all of this, and the program ends as with --version.
inline void describable(CLI::App& app) {
  app.add_flag_callback("--describe-command-line", [&app] { throw CLI::CallForVersion(toJson(app), 0); })->group("");
}

}  // namespace manual

// Prints the options and commands of a program as JSON, of which the build makes manual pages and completions.
#pragma once

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace manual {

/// Returns the text as a JSON string in quotes. Bytes above 0x7f are left unchanged: the text must be UTF-8.
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

/// Returns an option as a JSON object: its names, operand (name of a positional argument, else ""), value (name of its
/// type; "" for a flag), default, whether it is required and takes many values, names of the options that it excludes,
/// help.
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

/// Returns a program or command as a JSON object: name, help, footer, whether its commands accept its options, its
/// options and, recursively, its commands. Those that --help does not show are left out.
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

/// Adds the flag --describe-command-line, which --help does not show. app.parse() then throws CLI::CallForVersion with
/// toJson(app) as its text, so that the program prints it and ends as with --version. `app` must live until parse() has
/// ended.
inline void describable(CLI::App& app) {
  app.add_flag_callback("--describe-command-line", [&app] { throw CLI::CallForVersion(toJson(app), 0); })->group("");
}

}  // namespace manual

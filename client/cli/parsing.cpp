#include "client/cli/parsing.h"

#include "manual/number.h"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace traction::client {

CLI::Validator integer(const std::string& what) {
  return {[=](std::string& text) {
            long value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool isWhole = error == std::errc() && end == text.data() + text.size();
            return isWhole && value >= 0 ? std::string() : "'" + text + "' is not " + what;
          },
          ""};
}

CLI::Validator timeSpan() {
  return manual::number(0.0, 1e9, "a time from 0 to 1e9 s, as in 2.5");
}

void addSeconds(CLI::App& command, double& seconds) {
  command.add_option("--seconds", seconds, "duration; without it: until q or Ctrl-C")
      ->type_name("SECONDS")
      ->check(timeSpan());
}

std::string namesOf(const CLI::App& app) {
  std::string names;
  for (const CLI::App* one : app.get_subcommands([](const CLI::App*) { return true; })) {
    names += (names.empty() ? "" : ", ") + one->get_name();
  }
  return names;
}

std::string sentence(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* last = &app;
  std::string command = app.get_name();  // the part of the command line that was understood
  while (!last->get_subcommands().empty()) {
    last = last->get_subcommands()[0];
    command += " " + last->get_name();
  }
  const std::string what = error.what();
  const std::string help = "; see " + command + " --help";
  const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
  if (code == CLI::ExitCodes::ExtrasError) {
    const auto extras = app.remaining(true);
    const auto isExtra = [&](const std::string& word) { return std::ranges::find(extras, word) != extras.end(); };
    const auto first = std::ranges::find_if(words, isExtra);  // the parser lists them in another order
    const std::string word = first != words.end() ? *first : extras.at(0);
    const std::string names = namesOf(*last);
    if (word.rfind('-', 0) == 0 || names.empty()) return command + " does not understand '" + word + "'" + help;
    return "'" + word + "' is not one of " + names + help;
  }
  if (code == CLI::ExitCodes::ArgumentMismatch) return what.substr(0, what.find(':')) + " needs a value" + help;
  return what + help;
}

std::vector<std::string> wordsOf(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (std::ranges::find(words, "allow") == words.end() || std::ranges::find(words, "--") != words.end()) return words;
  const auto isOption = [](const std::string& word) {  // -h, --control, --directory=PATH
    if (word.size() < 3) return true;
    const auto name = std::string_view(word).substr(0, word.find('='));
    return name.size() > 2 && name.starts_with("--") &&
           std::ranges::all_of(name, [](char letter) { return (letter >= 'a' && letter <= 'z') || letter == '-'; });
  };
  const auto isKey = [&](const std::string& word) { return word.starts_with('-') && !isOption(word); };
  const auto key = std::ranges::find_if(words, isKey);
  if (key == words.end()) return words;
  std::rotate(key, key + 1, words.end());
  words.insert(words.end() - 1, "--");
  return words;
}

}  // namespace traction::client

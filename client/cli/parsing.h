// Validates the command line and words its errors.
#pragma once

#include <CLI/CLI.hpp>

#include <limits>
#include <string>
#include <vector>

namespace traction::client {

/// Returns a check for a whole number of 0 or more that fits a long. \param what completes the error "'TEXT' is not ",
/// such as "a number of messages, as in 100"
CLI::Validator integer(const std::string& what);

/// Returns a check for a duration from 0 to 10^9 s.
CLI::Validator timeSpan();

/// Duration of a command that ends on a signal only [s].
constexpr double kForever = std::numeric_limits<double>::infinity();

/// Adds the option --seconds to a command that otherwise runs until a key or a signal ends it.
void addSeconds(CLI::App& command, double& seconds);

/// Returns the names of the direct subcommands of `app`, parsed or not: "list, get, set"; empty if there are none.
std::string namesOf(const CLI::App& app);

/// Returns an error message of one line, with clearer wording than the parser's where needed. \param app command line
/// whose parsing failed \param words of wordsOf()
std::string sentence(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words);

/// Returns the arguments without the program's name. If one of them is "allow" and none is "--", the first one that
/// begins with a dash and is no option (-h, --control, --directory=PATH) is moved to the end, after a "--": it is the
/// key of `keys allow`, which would otherwise be taken for an option.
std::vector<std::string> wordsOf(int argc, char** argv);

}  // namespace traction::client

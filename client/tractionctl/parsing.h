// Validates the command line and words its errors.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace traction::cli {

/// Returns a check for a whole number of 0 or more. \param what completes the error, such as "a number of messages, as
/// in 100"
CLI::Validator integer(const std::string& what);

/// Returns a check for a finite number of at least `least`. \param what completes the error, such as "a time of 0 s or
/// more, as in 2.5"
CLI::Validator number(double least, const std::string& what);

/// Returns the names of all subcommands: "list, get, set".
std::string namesOf(const CLI::App& app);

/// Returns an error message, with clearer wording than the parser's where needed.
std::string sentence(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words);

/// Returns the arguments. Keys may begin with a dash without being an option, so they are moved to the end, after "--".
std::vector<std::string> wordsOf(int argc, char** argv);

}  // namespace traction::cli

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

/// Returns the names of all subcommands: "list, get, set"; empty if there are none.
std::string namesOf(const CLI::App& app);

/// Returns an error message of one line, with clearer wording than the parser's where needed. \param app command line
/// whose parsing failed \param words of wordsOf()
std::string sentence(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words);

/// Returns the arguments without the program's name. For `keys allow`, a key that begins with a dash is moved to the
/// end, after "--", unless there is a "--" already: it is not an option.
std::vector<std::string> wordsOf(int argc, char** argv);

}  // namespace traction::cli

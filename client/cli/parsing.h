// The command line as words: what they may be, and what is wrong with them.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace traction::cli {

/// Of an option: a count. \param what such as "a number of messages, as in 100"
CLI::Validator integer(const std::string& what);

/// Of an option: at least `least`. \param what such as "a time of 0 s or more, as in 2.5"
CLI::Validator number(double least, const std::string& what);

/// Of its commands: "list, get, set".
std::string namesOf(const CLI::App& app);

/// What is wrong, in words of ours where the parser's are hard to read.
std::string sentence(const CLI::ParseError& error, const CLI::App& app, const std::vector<std::string>& words);

/// Those of the command line. A key may begin with a dash, and is no option for that: it goes to the end, behind "--".
std::vector<std::string> wordsOf(int argc, char** argv);

}  // namespace traction::cli

// What the programs that follow contacts have in common: the options that say where their fields come from, and errors.
#pragma once

#include "base/error.h"
#include "traction/subscriber.h"

#include <CLI/CLI.hpp>

#include <exception>
#include <string>

namespace traction::contacts {

/// What the command line says of the source.
struct SourceWords {
  SubscriberOptions options;
  std::string keyFile, serverKey;
};

/// Adds --instance, --connect, --key and --server-key, which fill `words`.
/// \param instance help of --instance
/// \param excluded option that excludes the first two; null: none
void addSource(CLI::App& app, SourceWords& words, const std::string& instance, CLI::Option* excluded);

/// Returns the options to subscribe to fields and descriptions with. Reads the file of the key, if one is needed.
/// \throws Error, client::Failure
SubscriberOptions sourceOf(const SourceWords& words);

/// Prints an error on standard error, and returns its exit code.
int failed(const std::string& program, const tractiond::Error& error);
int failed(const std::string& program, const std::exception& error);

}  // namespace traction::contacts

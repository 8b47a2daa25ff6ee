// Options by which a program that follows contacts is told where their fields come from.
#pragma once

#include "traction/subscriber.h"

#include <CLI/CLI.hpp>
#include <tl/expected.hpp>

#include <string>

namespace traction::contacts {

/// What the command line says of the source.
struct SourceWords {
  SubscriberOptions options;
  std::string keyFile, serverKey;
};

/// Adds --instance, --connect, --key and --server-key, which fill `words`. \param instance help of --instance
/// \param excluded option that excludes the first two; null: none
void addSource(CLI::App& app, SourceWords& words, const std::string& instance, CLI::Option* excluded);

/// Returns the options to subscribe to the fields with. Reads the file of the key, if one is needed. On failure returns
/// an exit code, after printing an error on standard error.
tl::expected<SubscriberOptions, int> sourceOf(const SourceWords& words, const std::string& program);

}  // namespace traction::contacts

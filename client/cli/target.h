// Options of the command line that say which tractiond a command addresses.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <string>

namespace traction::client {

/// The options that all commands share. Valid after the command line has been parsed.
class Target {
 public:
  /// Adds the options --instance, --connect, --control, --host, --key and --server-key. `app` must outlive the object,
  /// which must outlive the parsing.
  explicit Target(CLI::App& app);

  /// Returns the options for a subscription: at --connect; else at the gateway of --host, the next port if `latest`;
  /// else at the instance. Reads the file of the client's key if --host, --key or --server-key is given.
  /// \param latest only the newest field is wanted: Mode::kLatest
  /// \throws Error kBadEndpoint if --host is used and not HOST or HOST:PORT, and what keysFor() throws: with --host
  /// alone and no usualKeyFile() there is no error, and the connection has no keys
  SubscriberOptions subscription(bool latest = false) const;
  /// Returns the options for requests: at --control; else at the gateway of --host, two ports above that of its stream;
  /// else at the instance. Reads the file of the key and throws as subscription().
  ControlOptions control() const;

  /// Returns the name of the instance; "default" if it was not given.
  const std::string& instance() const { return instance_; }
  /// Returns whether --instance was given.
  bool isInstanceNamed() const { return app_.count("--instance") != 0; }
  /// Returns the file of the client's key as given; empty: not given, so that usualKeyFile() is used.
  const std::filesystem::path& keyFile() const { return keyFile_; }

 private:
  /// Returns an endpoint of the gateway.
  /// \param offset of its port from that of the stream
  std::string atGateway(int offset) const;
  Keys keys() const;

  const CLI::App& app_;
  std::string instance_ = SubscriberOptions().instance;
  std::string stream_, control_, host_, serverKey_;
  std::filesystem::path keyFile_;
};

}  // namespace traction::client

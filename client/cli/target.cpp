#include "client/cli/target.h"

#include "client/files/keys.h"
#include "proto/traction/v1/endpoints.h"

#include <charconv>

namespace traction::client {

Target::Target(CLI::App& app)
    : app_(app) {
  app.add_option("--instance", instance_, "name of a tractiond on this machine")
      ->type_name("INSTANCE")
      ->capture_default_str();
  app.add_option("--connect", stream_, "ZeroMQ endpoint of the stream, instead of the instance's")
      ->type_name("ENDPOINT");
  app.add_option("--control", control_, "ZeroMQ endpoint for requests, instead of the instance's")
      ->type_name("ENDPOINT");
  app.add_option(
         "--host", host_,
         "address of a traction-gateway, HOST or HOST:PORT of its stream, instead of an instance on this machine")
      ->type_name("HOST");
  app.add_option("--key", keyFile_, "file of your key; without it: ~/.config/traction/key")->type_name("FILE");
  app.add_option("--server-key", serverKey_,
                 "public key of the gateway, as tractionctl keys list prints it on its machine")
      ->type_name("KEY");
}

SubscriberOptions Target::subscription(bool latest) const {
  SubscriberOptions options;
  options.instance = instance_;
  options.endpoint = stream_.empty() && !host_.empty() ? atGateway(latest ? 1 : 0) : stream_;
  if (latest) options.mode = Mode::kLatest;
  options.keys = keys();
  return options;
}

ControlOptions Target::control() const {
  return {
      .instance = instance_, .endpoint = control_.empty() && !host_.empty() ? atGateway(2) : control_, .keys = keys()};
}

std::string Target::atGateway(int offset) const {
  std::string host = host_;
  int port = kGatewayPort;
  const std::size_t colon = host_.rfind(':');
  if (colon != std::string::npos && host_.back() != ']') {
    const auto [end, error] = std::from_chars(&host_[colon + 1], &*host_.end(), port);
    if (error != std::errc() || end != &*host_.end() || port < 1 || port > 65533) {
      throw Error(ErrorCode::kBadEndpoint, "'" + host_ + "' is not HOST or HOST:PORT");
    }
    host.resize(colon);
  }
  return "tcp://" + host + ":" + std::to_string(port + offset);
}

Keys Target::keys() const {
  return host_.empty() && keyFile_.empty() && serverKey_.empty() ? Keys() : keysFor(serverKey_, keyFile_);
}

}  // namespace traction::client

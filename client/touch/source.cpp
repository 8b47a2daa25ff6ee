#include "client/touch/source.h"

#include "base/service/log.h"
#include "client/files/failure.h"
#include "client/files/keys.h"
#include "proto/traction/v1/endpoints.h"

#include <spdlog/spdlog.h>
#include <sysexits.h>

#include <iostream>
#include <new>

namespace traction::contacts {

void addSource(CLI::App& app, SourceWords& words, const std::string& instance, CLI::Option* excluded) {
  CLI::Option* const name =
      app.add_option("--instance", words.options.instance, instance)
          ->type_name("INSTANCE")
          ->capture_default_str()
          ->check([](const std::string& given) {
            return isValidName(given) ? "" : "\"" + given + "\" is not a name: 1 to 24 of A-Z, a-z, 0-9, _ and - are";
          });
  CLI::Option* const endpoint =
      app.add_option("--connect", words.options.endpoint, "ZeroMQ endpoint of the stream, instead of the instance's")
          ->type_name("ENDPOINT");
  if (excluded != nullptr) {
    name->excludes(excluded);
    endpoint->excludes(excluded);
  }
  app.add_option("--key", words.keyFile, "file of your key for a gateway; without: ~/.config/traction/key")
      ->type_name("FILE");
  app.add_option("--server-key", words.serverKey,
                 "public key of the gateway, as tractionctl keys prints it on its host")
      ->type_name("KEY");
}

SubscriberOptions sourceOf(const SourceWords& words) {
  SubscriberOptions options = words.options;
  options.topics = kField | kDescription;  // where the nodes are
  if (!words.keyFile.empty() || !words.serverKey.empty())
    options.keys = client::keysFor(words.serverKey, words.keyFile);
  return options;
}

int failed(const std::string& program, const tractiond::Error& error) {
  std::cerr << tractiond::logLine(program, spdlog::level::err, error.message()) << "\n";
  return error.exitCode;
}

int failed(const std::string& program, const std::exception& error) {
  tractiond::Error reported{.exitCode = EX_OSERR, .what = error.what()};
  if (const auto* file = dynamic_cast<const client::Failure*>(&error)) reported.exitCode = file->exitCode();
  if (const auto* ours = dynamic_cast<const Error*>(&error))
    reported.exitCode = ours->code() == ErrorCode::kBadKeys ? EX_CONFIG : EX_USAGE;
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr)
    reported = {.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"};
  return failed(program, reported);
}

}  // namespace traction::contacts

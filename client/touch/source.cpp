#include "client/touch/source.h"

#include "client/files/file_error.h"
#include "client/files/keys.h"
#include "proto/traction/v1/endpoints.h"

#include <sysexits.h>

#include <iostream>

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

tl::expected<SubscriberOptions, int> sourceOf(const SourceWords& words, const std::string& program) {
  const auto failed = [&](int exitCode, const std::string& what) {
    std::cerr << program << ": " << what << '\n';
    return tl::unexpected(exitCode);
  };
  SubscriberOptions options = words.options;
  options.topics = kField;
  try {
    if (!words.keyFile.empty() || !words.serverKey.empty())
      options.keys = client::keysFor(words.serverKey, words.keyFile);
  } catch (const client::FileError& error) {
    return failed(error.exitCode(), error.what());
  } catch (const Error& error) {
    return failed(EX_CONFIG, error.what());
  }
  return options;
}

}  // namespace traction::contacts

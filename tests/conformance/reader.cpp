// The C++ client under the conformance suite: docs/clients.md says what a reader is.

#include "client/show/json.h"
#include "traction/control.h"
#include "traction/subscriber.h"

#include <array>
#include <cstddef>
#include <iostream>

namespace {

/// By ErrorCode.
constexpr std::array kNames = {"bad_endpoint", "no_answer", "version",    "malformed",
                               "refused",      "bad_keys",  "not_allowed"};

/// What came of `read`, which returns JSON.
template <typename Read>
std::string told(Read&& read) {
  try {
    return "\"message\":" + read();
  } catch (const traction::Error& error) {
    return std::string("\"error\":\"") + kNames.at(static_cast<std::size_t>(error.code())) + '"';
  }
}

std::string answer(const traction::Control& control, const std::string& what) {
  using traction::client::toJson;
  if (what == "status") return toJson(control.status());
  if (what == "describe") return toJson(control.description());
  return toJson(what == "zero" ? control.zero() : control.undoZero());
}

void ask(const std::string& endpoint) {
  traction::ControlOptions options;
  options.endpoint = endpoint;
  const traction::Control control(options);
  for (std::string what; std::getline(std::cin, what);) {
    std::cout << '{' << told([&] { return answer(control, what); }) << '}' << std::endl;
  }
}

[[noreturn]] void read(const std::string& endpoint, traction::Mode mode) {
  traction::SubscriberOptions options;
  options.endpoint = endpoint;
  options.mode = mode;
  options.topics = traction::kAllTopics | traction::kPreview | traction::kOfTouch;
  traction::Subscriber subscriber(options);
  for (;;) {
    const std::string line = told([&] {
      for (;;) {
        if (const auto message = subscriber.receive(std::chrono::hours(1))) return traction::client::toJson(*message);
      }
    });
    std::cout << '{' << line << ",\"lost\":" << subscriber.lost() << '}' << std::endl;
  }
}

}  // namespace

/// reader stream | latest | control ENDPOINT
int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const std::string mode = argv[1];
  if (mode == "control") {
    ask(argv[2]);
  } else {
    read(argv[2], mode == "latest" ? traction::Mode::kLatest : traction::Mode::kStream);
  }
}

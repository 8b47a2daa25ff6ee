// An instrument whose messages a test sends, and what the views of tractionctl show of it.
#pragma once

#include "client/show/board.h"
#include "client/show/picture.h"
#include "traction/v1/status.pb.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <regex>
#include <string>

namespace traction::client::test {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Returns a field of 24 x 24 nodes, of which one has a force.
inline Field fieldOf(int column, int row, std::array<float, 3> force) {
  Field field;
  field.valid = true;
  field.force_N.assign(std::size_t{24} * 24, {0.0F, 0.0F, 0.0F});
  field.nodeValid.assign(field.force_N.size(), 1);
  field.force_N[static_cast<std::size_t>(row * 24 + column)] = force;
  field.resultant_N = {force[0], force[1], force[2]};
  return field;
}

/// Returns the characters of a page without colours, one line per row, each with a line end.
inline std::string charactersOf(const Canvas& page) {
  static const std::regex kRow("\x1b\\[[0-9]+;1H"), kOther("\x1b\\[[0-9;]*[Hm]");
  const std::string rows = std::regex_replace(page.render(Depth::kNone), kRow, "\n");
  const std::string text = std::regex_replace(rows, kOther, "") + "\n";
  return text.substr(1);  // each row is behind an end of a line
}

class Instrument {
 public:
  Instrument() {
    watched.name = "left";
    watched.scene.setConnected(true, now);
    status.set_camera(v1::CAMERA_STATE_STREAMING);
    status.mutable_rates()->set_received_hz(60.0);
  }
  /// Fields at 60 Hz, and a status each second.
  void run(double seconds) {
    for (const std::int64_t end = now + std::llround(seconds * 1e9); now < end; now += kSecond_ns / 60) {
      field();
      if (now - statusAt_ >= kSecond_ns) sendStatus();
    }
  }
  Instrument& after(double seconds) {
    now += std::llround(seconds * 1e9);
    return *this;
  }
  void field() { field(fieldOf(3, 4, {0.25F, -0.5F, 3.75F})); }
  void field(Field one) {
    one.header.flags = flags;
    send(one);
  }
  void sendStatus() {
    statusAt_ = now;
    status.set_uptime_s(static_cast<double>(now) * 1e-9);
    send(Status{{}, std::make_shared<v1::Status>(status)});
  }
  void camera(v1::CameraState state, double received_hz = 60.0, const std::string& why = "") {
    status.set_camera(state);
    status.mutable_rates()->set_received_hz(received_hz);
    status.set_camera_why(why);
    sendStatus();
  }
  void describe(bool sameHost = true) {
    Description description;
    description.sameHost = sameHost;
    description.nodes = {24, 24, 3e-3, {}};
    send(description);
  }
  template <typename Any>
  void send(Any message) {
    message.header.arrived_ns = now;
    message.header.boot = boot;
    watched.scene.add(message);
  }

  std::string board(int width = 80, int height = 24) const {
    return charactersOf(drawBoard({watched}, width, height, now));
  }
  std::string row(const std::string& label) const {
    const std::string text = boardText(watched, now);
    std::smatch match;
    return std::regex_search(text, match, std::regex("(^|\n) +" + label + "  +([^\n]*)")) ? match[2].str() : "";
  }
  std::string picture(int width = 100, int height = 30) const {
    Scale scale;
    return charactersOf(draw(watched.scene, width, height, scale, now, "ipc:///run/tractiond/default/stream"));
  }
  std::string line() const { return summary(watched.scene, now); }
  std::string trouble() const { return watched.scene.trouble(now).what; }

  Watched watched;
  v1::Status status;
  std::uint32_t flags = 0;
  std::int64_t now = 10 * kSecond_ns;
  Id boot{1};

 private:
  std::int64_t statusAt_ = 0;
};

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace traction::client::test

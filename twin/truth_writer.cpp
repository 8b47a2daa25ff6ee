#include "twin/truth_writer.h"

#include <sysexits.h>
#include <zmq.hpp>

#include <array>
#include <cerrno>
#include <cstring>

namespace twin {

namespace {

constexpr const char* kTopic = "truth/";

std::string number(double value, const char* format = "%.9g") {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

template <typename Numbers>
std::string list(const Numbers& numbers, const char* format = "%.9g") {
  std::string text = "[";
  for (const auto value : numbers) {
    if (text.size() > 1) text += ",";
    text += number(static_cast<double>(value), format);
  }
  return text + "]";
}

std::string toJson(const Truth::Load& load) {
  const bool isDisc = load.shape == Contact::Shape::kDisc;
  const std::string place =
      load.onBody ? list(load.onBody->place) + R"(,"normal":)" + list(load.onBody->normal) : list(load.state.position);
  return std::string(R"({"shape":")") + (isDisc ? "disc" : "hertz") + R"(","position_m":)" + place + R"(,"radius_m":)" +
         number(load.radius) + R"(,"force_N":)" + list(load.state.force) + R"(,"torque_Nm":)" +
         number(load.state.torque) + (load.stickRatio ? R"(,"stick_ratio":)" + number(*load.stickRatio) : "") + "}";
}

std::string toJson(const Hand::State& hand) {
  const auto word = [](bool is) { return is ? "true" : "false"; };
  return R"({"opening_m":)" + number(hand.opening) + R"(,"height_m":)" + number(hand.height) + R"(,"friction":)" +
         number(hand.friction) + R"(,"mass_kg":)" + number(hand.mass) + R"(,"clearance_m":)" + number(hand.clearance) +
         R"(,"slid_m":)" + number(hand.slid) + R"(,"lifted":)" + word(hand.lifted) + R"(,"dropped":)" +
         word(hand.dropped) + R"(,"broken":)" + word(hand.broken) + "}";
}

}  // namespace

std::string toJson(const Truth& truth, const Stamp& stamp, bool withMarkers) {
  std::string text = R"({"camera_frame_id":)" + std::to_string(stamp.cameraFrameId) + R"(,"device_ns":)" +
                     std::to_string(stamp.device_ns) + R"(,"monotonic_ns":)" + std::to_string(stamp.monotonic_ns) +
                     R"(,"scenario_s":)" + number(truth.time_s);
  if (truth.image) return text + R"(,"image":)" + std::to_string(*truth.image) + "}";
  text += R"(,"force_N":)" + list(truth.resultant.force) + R"(,"moment_Nm":)" + list(truth.resultant.moment) +
          R"(,"contacts":[)";
  for (const Truth::Load& load : truth.contacts) {
    if (&load != &truth.contacts.front()) text += ",";
    text += toJson(load);
  }
  text += R"(],"missing":)" + list(truth.missing, "%.0f");
  if (truth.rise_K != 0.0) text += R"(,"rise_K":)" + number(truth.rise_K);
  if (truth.torn) text += R"(,"torn":true)";
  if (truth.finger) text += R"(,"finger":)" + std::to_string(*truth.finger) + R"(,"hand":)" + toJson(truth.hand);
  if (withMarkers) text += R"(,"displacement_px":)" + list(truth.displacement_px.reshaped(), "%.4f");
  return text + "}";
}

struct TruthWriter::Socket {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::pub};
};

TruthWriter::TruthWriter()
    : file_(nullptr, &std::fclose) {}
TruthWriter::~TruthWriter() = default;

tl::expected<std::unique_ptr<TruthWriter>, Failure> TruthWriter::open(const TruthOptions& options) {
  auto writer = std::unique_ptr<TruthWriter>(new TruthWriter);
  writer->markers_ = options.markers;
  if (!options.file.empty()) {
    writer->file_.reset(std::fopen(options.file.c_str(), "w"));
    if (!writer->file_) {
      return tl::unexpected(
          Failure{EX_CANTCREAT, "cannot write the truth to " + options.file.string() + ": " + std::strerror(errno)});
    }
  }
  if (!options.endpoint.empty()) {
    try {
      writer->socket_ = std::make_unique<Socket>();
      writer->socket_->socket.set(zmq::sockopt::linger, 0);
      writer->socket_->socket.bind(options.endpoint);
    } catch (const zmq::error_t& error) {
      const int code = error.num() == EADDRINUSE ? EX_UNAVAILABLE : EX_USAGE;
      return tl::unexpected(Failure{code, "cannot publish the truth on " + options.endpoint + ": " + error.what()});
    }
  }
  return writer;
}

void TruthWriter::write(const Truth& truth, const Stamp& stamp) {
  if (!file_ && !socket_) return;
  const std::string record = toJson(truth, stamp, markers_);
  if (file_) {
    std::fprintf(file_.get(), "%s\n", record.c_str());
    std::fflush(file_.get());
  }
  if (socket_) {
    try {
      socket_->socket.send(zmq::buffer(std::string_view(kTopic)), zmq::send_flags::sndmore);
      socket_->socket.send(zmq::buffer(record), zmq::send_flags::dontwait);
    } catch (const zmq::error_t&) {
      // Interrupted by a signal: the twin is about to end, and the record is lost.
    }
  }
}

}  // namespace twin

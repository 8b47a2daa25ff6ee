#include "twin/truth_writer.h"

#include <array>
#include <cerrno>
#include <cstring>

namespace twin {

namespace {

std::string number(double value, const char* format = "%.9g") {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

std::string list(const auto& numbers, const char* format = "%.9g") {
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
  if (truth.finger) text += R"(,"finger":)" + std::to_string(*truth.finger) + R"(,"hand":)" + toJson(truth.hand);
  if (withMarkers) text += R"(,"displacement_px":)" + list(truth.displacement_px.reshaped(), "%.4f");
  return text + "}";
}

tl::expected<TruthWriter, tractiond::Error> TruthWriter::open(const std::filesystem::path& file, bool withMarkers) {
  TruthWriter writer;
  writer.withMarkers_ = withMarkers;
  if (file.empty()) return writer;
  writer.file_.reset(std::fopen(file.c_str(), "w"));
  if (writer.file_) return writer;
  return tl::unexpected(
      tractiond::Error{EX_CANTCREAT, std::string("cannot be written: ") + std::strerror(errno), file});
}

void TruthWriter::write(const Truth& truth, const Stamp& stamp) {
  if (!file_) return;
  std::fprintf(file_.get(), "%s\n", toJson(truth, stamp, withMarkers_).c_str());
  std::fflush(file_.get());
}

}  // namespace twin

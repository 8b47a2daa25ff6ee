// What a recording has besides the topics of the stream.
#include "daemon/publish/wire_recording.h"
#include "tests/fuzz/target.h"

namespace fuzz {
namespace {

using tractiond::RestPose;
namespace publish = tractiond::publish;

RestPose pose() {
  RestPose pose;
  pose.position_px = {1.0F, 2.0F};
  pose.amplitude = {50.0F};
  pose.present = {1};
  return pose;
}

}  // namespace

std::vector<std::string> seeds() {
  publish::Beginning beginning;
  beginning.message.set_sensor("gel");
  beginning.message.set_calibration(std::string(16, 'c'));
  beginning.message.set_gel("format = 1");
  beginning.rest = pose();
  publish::TrackedFrame frame;
  frame.bytes.assign(8 * 4 * 3, 7);
  frame.frame.data = frame.bytes.data();
  frame.frame.size = frame.bytes.size();
  frame.frame.width = 8;
  frame.frame.height = 4;
  frame.frame.stride = 24;
  frame.inputs.adopted = frame.inputs.compared = true;
  frame.inputs.zero = pose();
  publish::PictureMessage message({.sensor = "gel"});
  return {encode(beginning), message.encode(frame, false), message.encode(frame, true)};
}

bool feed(std::string_view bytes) {
  static publish::TrackedFrame frame;
  const bool begins = publish::decodeBeginning(bytes).has_value();
  if (!publish::decodePicture(bytes, frame)) return begins;
  require(frame.bytes.size() == frame.frame.size && frame.frame.data == frame.bytes.data(),
          "a picture without its bytes");
  return true;
}

}  // namespace fuzz

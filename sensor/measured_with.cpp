#include "sensor/measured_with.h"

namespace sensor {

MeasuredWith MeasuredWith::parse(const std::string& text) {
  const std::size_t at = text.ends_with(')') ? text.rfind(" (") : text.npos;
  if (at == text.npos) return {.camera = text, .picture = ""};
  return {.camera = text.substr(0, at), .picture = text.substr(at + 2, text.size() - at - 3)};
}

std::string MeasuredWith::text() const {
  return camera.empty() || picture.empty() ? camera : camera + " (" + picture + ")";
}

bool MeasuredWith::holdsFor(const MeasuredWith& other) const {
  const auto same = [](const std::string& one, const std::string& two) {
    return one.empty() || two.empty() || one == two;
  };
  return same(camera, other.camera) && same(picture, other.picture);
}

std::string cameraId(const std::string& vendor, const std::string& serial) {
  std::string id = vendor + "-" + serial;
  for (char& c : id) {
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '_';
  }
  return id;
}

}  // namespace sensor

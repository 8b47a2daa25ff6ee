#include "sensor/gel_file.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"

namespace fuzz {

std::vector<std::string> seeds() {
  sensor::Sensor calibrated;
  calibrated.calibration = sensor::Calibration{};
  return {fileText(tractiond::test::source("config/gels/paper.toml")),
          fileText(tractiond::test::source("config/gels/black_dots.toml")), sensor::gelText(calibrated)};
}

bool feed(std::string_view bytes) {
  const auto sensor = sensor::parseGel(bytes, "/nowhere/fuzz.toml");
  if (!sensor) return false;
  require(sensor->body || sensor::parseGel(sensor::gelText(*sensor), "fuzz"), "what is written is not read");
  return true;
}

}  // namespace fuzz

#include "sensor/influence_file.h"
#include "tests/fuzz/target.h"
#include "tests/support/npz.h"

namespace fuzz {
namespace {

std::vector<double> counted(int count, double step) {
  std::vector<double> values;
  for (int i = 1; i <= count; ++i) values.push_back(step * i);
  return values;
}

}  // namespace

/// Of two markers and two nodes.
std::vector<std::string> seeds() {
  return {npz::archive({{"format", npz::text("traction-influence/1")},
                        {"units", npz::text("SI")},
                        {"youngs_modulus", npz::numbers("", {2e3})},
                        {"influence", npz::numbers("2, 3, 2, 3", counted(36, 1e-3))},
                        {"node_positions", npz::numbers("2, 3", counted(6, 1e-3))},
                        {"node_normals", npz::numbers("2, 3", {0.0, 0.6, 0.8, 0.0, 0.6, 0.8})},
                        {"node_areas", npz::numbers("2,", counted(2, 1e-6))},
                        {"marker_positions", npz::numbers("2, 3", counted(6, 1e-3))}})};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  auto body = sensor::loadBody(file.path());
  if (!body) return false;
  sensor::Sensor sensor;
  static_cast<void>(sensor::setBody(sensor, *std::move(body)));
  return true;
}

}  // namespace fuzz

#include "daemon/solve/factors_file.h"
#include "tests/fuzz/target.h"

#include <filesystem>

namespace fuzz {
namespace {

using tractiond::solve::Atoms, tractiond::solve::Factors;

constexpr int kCoordinates = 36, kRank = 10;

const Atoms& fewAtoms() {
  static const Atoms atoms = [] {
    sensor::Sensor sensor;
    sensor.nodes.columns = sensor.nodes.rows = 2;
    return tractiond::solve::makeAtoms(sensor);
  }();
  return atoms;
}

/// Returns factors whose numbers mean nothing: the file's reader looks at sizes and checksums.
Factors small() {
  using tractiond::solve::kMotions, tractiond::solve::RowMatrix;
  const int points = 3 * fewAtoms().pointCount(), atoms = fewAtoms().count();
  Factors factors;
  factors.id.fill(std::uint8_t{7});
  factors.force_N = 0.5;
  factors.singularValues.assign(kRank, 2.0);
  factors.left = RowMatrix(kCoordinates, kRank + kMotions);
  factors.motionGain.setConstant(0.25);
  factors.right = RowMatrix(points, kRank);
  factors.influence = RowMatrix(3 * atoms, kCoordinates);
  factors.gram.assign(static_cast<std::size_t>(9 * atoms * (atoms + 1) / 2), 3.0);
  factors.motion = RowMatrix(kMotions, kCoordinates);
  factors.motionCoupling.setZero(kMotions, 3 * atoms);
  factors.motionGram.setIdentity();
  factors.systematicErrors.contact.assign(36 * 7, 1e-3);
  factors.systematicErrors.wholeFace.assign(36 * 7, 1e-2);
  return factors;
}

}  // namespace

std::vector<std::string> seeds() {
  const auto path = std::filesystem::temp_directory_path() / ("factors-fuzz-" + std::to_string(getpid()) + ".factors");
  if (!tractiond::solve::saveFactors(path, small())) return {};
  const std::string bytes = fileText(path);
  std::filesystem::remove(path);
  return {bytes};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  return tractiond::solve::loadFactors(file.path(), small().id, kCoordinates, fewAtoms()).has_value();
}

}  // namespace fuzz

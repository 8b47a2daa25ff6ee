#include "daemon/solve/inverse_file.h"
#include "tests/fuzz/target.h"

#include <filesystem>

namespace fuzz {
namespace {

constexpr int kCoordinates = 36, kForces = 12, kRank = 10;

/// Returns an inverse whose numbers mean nothing: the file's reader looks at sizes and checksums.
tractiond::solve::Inverse small() {
  using tractiond::solve::kMotions, tractiond::solve::RowMatrix;
  tractiond::solve::Inverse inverse;
  inverse.id.fill(std::uint8_t{7});
  inverse.lambda = 0.5;
  inverse.singularValues.assign(kRank, 2.0);
  inverse.left = RowMatrix(kCoordinates, kRank + kMotions);
  inverse.right = RowMatrix(kRank, kForces);
  inverse.motionGain.assign(kMotions, 0.25);
  inverse.motionVariance.assign(kMotions, 1.0);
  inverse.hat.assign(kCoordinates * (kCoordinates + 1) / 2, 0.1F);
  inverse.influence = RowMatrix(kForces, kCoordinates);
  inverse.gram.assign(kForces * (kForces + 1) / 2, 3.0);
  inverse.motion = RowMatrix(kMotions, kCoordinates);
  inverse.systematicErrors.contact.assign(36 * 7, 1e-3);
  inverse.systematicErrors.wholeFace.assign(36 * 7, 1e-2);
  return inverse;
}

}  // namespace

std::vector<std::string> seeds() {
  const auto path = std::filesystem::temp_directory_path() / ("inverse-fuzz-" + std::to_string(getpid()) + ".inverse");
  if (!tractiond::solve::saveInverse(path, small())) return {};
  const std::string bytes = fileText(path);
  std::filesystem::remove(path);
  return {bytes};
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  return tractiond::solve::loadInverse(file.path(), small().id, kCoordinates, kForces).has_value();
}

}  // namespace fuzz

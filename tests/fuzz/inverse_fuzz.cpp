#include "daemon/solve/inverse_cache.h"
#include "tests/fuzz/target.h"

#include <filesystem>

namespace fuzz {
namespace {

const tractiond::solve::Inverse& small() {
  static const tractiond::solve::Inverse inverse = [] {
    sensor::Sensor sensor;
    for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 3;
    sensor.nodes.columns = sensor.nodes.rows = 2;
    tractiond::solve::SolveOptions options;
    options.model = sensor::elastic::Model::kHalfSpace;
    auto computed = tractiond::solve::loadOrCompute(
        sensor, options, std::filesystem::temp_directory_path() / ("inverse-fuzz-" + std::to_string(getpid())));
    require(computed.has_value(), "there is no inverse");
    return *std::move(computed);
  }();
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
  return tractiond::solve::loadInverse(file.path(), small().id, small().coordinateCount(), small().forceCount())
      .has_value();
}

}  // namespace fuzz

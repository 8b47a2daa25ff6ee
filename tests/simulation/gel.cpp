#include "tests/simulation/gel.h"

#include "sensor/elastic/influence.h"
#include "tests/simulation/disk.h"

#include <cmath>
#include <utility>

namespace tractiond::simulation {

Gel::Gel() {
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = 8;
    layer.rows = 6;
  }
  sensor.nodes.columns = 7;
  sensor.nodes.rows = 6;
  options.model = sensor::elastic::Model::kHalfSpace;
  places = track::nominalPlaces(sensor);
  const Eigen::MatrixXd exact =
      sensor::elastic::toImage(sensor, sensor::elastic::displacementMatrix(sensor, options.model));
  Eigen::VectorXd force = Eigen::VectorXd::Zero(exact.cols());
  for (const int node : {16, 17, 23, 24}) force[3 * node + 2] = 0.25;
  press = exact * force;
  Chance chance(1);
  const auto uniform = [&chance] { return (static_cast<double>(chance.next() >> 11) + 0.5) * 0x1p-53; };
  constexpr std::size_t kNoises = 128;
  for (std::size_t k = 0; k < kNoises; ++k) {
    std::vector<float> noise(2 * places.size());
    for (float& value : noise)
      value = static_cast<float>(kNoise_px * std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * M_PI * uniform()));
    noises.push_back(std::move(noise));
  }
}

}  // namespace tractiond::simulation

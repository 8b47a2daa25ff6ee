// How the touched surface moves at the nodes under their forces, as the viewer computes it.
//
// usage: evaluation_surface JOB GEL      reads JOB/force.f64 (frames x nodes x 3, N), writes JOB/surface.f64 (m)
#include "sensor/elastic/surface.h"

#include "tests/evaluation/eye.h"

#include <filesystem>
#include <fstream>

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const std::filesystem::path job = argv[1];
  const sensor::Sensor sensor = evaluation::loadSensor(argv[2]);
  const Eigen::MatrixXd matrix =
      sensor::elastic::surfaceMatrix(sensor.gel, sensor::nodePositions(sensor), sensor.nodes.pitch);
  std::ifstream in(job / "force.f64", std::ios::binary);
  std::ofstream out(job / "surface.f64", std::ios::binary);
  Eigen::VectorXd force(matrix.cols()), moved(matrix.rows());
  const auto bytes = static_cast<std::streamsize>(sizeof(double)) * matrix.cols();
  while (in.read(reinterpret_cast<char*>(force.data()), bytes)) {
    moved.noalias() = matrix * force;
    out.write(reinterpret_cast<const char*>(moved.data()), bytes);
  }
  return out ? 0 : 74;
}

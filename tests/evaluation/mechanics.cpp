// The project's own mechanics, to be held against an independent program's: displacements of a gel's markers under
// forces at points of its surface.
//
// usage: evaluation_mechanics JOB GEL      reads JOB/forces.f64 (rows of load number, x, y [m], force x, y, z [N]),
// writes JOB/displacement.f64 (loads x markers x 3, m)
#include "sensor/elastic/block.h"
#include "sensor/elastic/half_space.h"
#include "sensor/gel_file.h"

#include <filesystem>
#include <fstream>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const std::filesystem::path job = argv[1];
  const auto sensor = sensor::loadGel(argv[2]);
  if (!sensor) {
    std::cerr << sensor.error().what << "\n";
    return 65;
  }
  std::ifstream in(job / "forces.f64", std::ios::binary);
  std::array<double, 6> row{};
  std::vector<std::array<double, 6>> rows;
  double clearance = 1.0;
  while (in.read(reinterpret_cast<char*>(row.data()), sizeof row)) {
    rows.push_back(row);
    for (const int axis : {0, 1}) {
      clearance = std::min(clearance, 0.5 * sensor->gel.size[axis] - std::abs(row[static_cast<std::size_t>(axis) + 1]));
    }
  }
  const sensor::Points markers = sensor::markerPositions(sensor->layers);
  const sensor::elastic::BlockCorrection correction(sensor->gel, markers, {.clearance = clearance});
  std::ofstream out(job / "displacement.f64", std::ios::binary);
  for (std::size_t first = 0, end = 0; first < rows.size(); first = end) {
    while (end < rows.size() && rows[end][0] == rows[first][0]) ++end;
    const auto count = static_cast<Eigen::Index>(end - first);
    sensor::Points points(3, count);
    Eigen::Matrix3Xd forces(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto& [load, x, y, fx, fy, fz] = rows[first + static_cast<std::size_t>(i)];
      points.col(i) << x, y, 0.0;
      forces.col(i) << fx, fy, fz;
    }
    sensor::Points displacement = correction.displacement(points, forces);
    for (Eigen::Index m = 0; m < markers.cols(); ++m) {
      for (Eigen::Index i = 0; i < count; ++i) {
        displacement.col(m) +=
            sensor::elastic::halfSpaceDisplacement(markers.col(m) - points.col(i), sensor->gel.youngsModulus,
                                                   sensor->gel.poissonRatio) *
            forces.col(i);
      }
    }
    out.write(reinterpret_cast<const char*>(displacement.data()),
              static_cast<std::streamsize>(displacement.size() * sizeof(double)));
  }
  return out ? 0 : 74;
}

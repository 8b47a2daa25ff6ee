// The critical points of the shear of fields, as traction-touch finds them, in the nodes of the paper's gel.
//
// usage: evaluation_points JOB LEAST     reads JOB/field.f32 (frames x 2 x 576 x 3, N: forces, deviations), writes
// JOB/points.f64: for each point of at least this strength frame, index, strength, angle [rad], place x, y [m],
// deviations [m], place between the nodes [m]
#include "sensor/gel.h"
#include "touch/critical_points.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  const std::filesystem::path job = argv[1];
  const sensor::NodeGrid grid;
  std::vector<std::array<float, 3>> force_N(static_cast<std::size_t>(grid.count())), deviation_N(force_N.size());
  std::ifstream in(job / "field.f32", std::ios::binary);
  std::ofstream out(job / "points.f64", std::ios::binary);
  const auto read = [&](std::vector<std::array<float, 3>>& numbers) {
    const std::size_t size = numbers.size() * sizeof numbers[0];
    return bool(in.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(size)));
  };
  for (int frame = 0; read(force_N) && read(deviation_N); ++frame) {
    const touch::NodeForces nodes{.columns = grid.columns,
                                  .rows = grid.rows,
                                  .pitch_m = grid.pitch,
                                  .centre_m = {grid.centre.x(), grid.centre.y()},
                                  .force_N = force_N,
                                  .deviation_N = deviation_N};
    for (const touch::CriticalPoint& each : touch::criticalPoints(nodes, std::atof(argv[2]))) {
      const std::array<double, 10> row = {double(frame),
                                          double(each.index),
                                          each.strength,
                                          each.angle_rad,
                                          each.position_m[0],
                                          each.position_m[1],
                                          each.positionDeviation_m[0],
                                          each.positionDeviation_m[1],
                                          each.betweenNodes_m[0],
                                          each.betweenNodes_m[1]};
      out.write(reinterpret_cast<const char*>(row.data()), sizeof row);
    }
  }
  return out ? 0 : 74;
}

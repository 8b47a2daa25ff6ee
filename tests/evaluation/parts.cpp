// Parts of the project, each by itself, on numbers from elsewhere, which are files of a folder JOB.
//
// usage: evaluation_parts mechanics JOB GEL   displacements of a gel's markers under forces at points of its surface:
//                     reads forces.f64 (rows of load number, x, y [m], force x, y, z [N]), writes displacement.f64
//                     (loads x markers x 3, m)
//        evaluation_parts surface JOB GEL     how the touched surface moves at the nodes under their forces, as the
//                     viewer computes it: reads force.f64 (frames x nodes x 3, N), writes surface.f64 (m)
//        evaluation_parts points JOB LEAST    the critical points of the shear of fields, as traction-touch finds them,
//                     in the nodes of the paper's gel: reads field.f32 (frames x 2 x 576 x 3, N: forces, deviations),
//                     writes points.f64: for each point of at least this strength frame, index, strength, angle [rad],
//                     place x, y [m], deviations [m], place between the nodes [m]
//        evaluation_parts slip JOB            what traction-touch says of the slip of contacts, frame after frame:
//                     reads observations.f64, rows of 24 numbers, one a contact: sequence, time [s], position 2 [m],
//                     deviation 2, force 3 [N], deviation 3, area [m^2], deviation, spread ratio, deviation, torque
//                     [N m], variance, half axes 2 [m], deviation 2, orientation [rad], deviation. Contacts of one time
//                     are a field; one without normal force says that there is none. Sequences follow each other, and
//                     have nothing to do with each other. Writes slip.f64: fields x 10, of the contact that is pressed
//                     most: state (-1: not known, or a lower bound alone), stick ratio 3, friction 3 (estimate, low,
//                     high), probability of incipient slip, force that would hold, model
#include "sensor/elastic/block.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/surface.h"
#include "tests/evaluation/eye.h"
#include "touch/contact_tracker.h"
#include "touch/critical_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace {

using namespace evaluation;
using std::filesystem::path;

void writeAll(const path& file, const std::vector<double>& numbers) {
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(numbers.data()),
            static_cast<std::streamsize>(numbers.size() * sizeof numbers[0]));
  if (!out) fail(file.string() + " cannot be written");
}

template <typename Numbers>
void append(std::vector<double>& all, const Numbers& numbers) {
  all.insert(all.end(), numbers.data(), numbers.data() + numbers.size());
}

void mechanics(const path& job, const std::string& gel) {
  const sensor::Sensor sensor = loadSensor(gel);
  const auto rows = readAll<std::array<double, 6>>(job / "forces.f64");
  double clearance = 1.0;
  for (const auto& row : rows) {
    for (const int axis : {0, 1})
      clearance = std::min(clearance, 0.5 * sensor.gel.size[axis] - std::abs(row[static_cast<std::size_t>(axis) + 1]));
  }
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  const sensor::elastic::BlockCorrection correction(sensor.gel, markers, {.clearance = clearance});
  std::vector<double> all;
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
    sensor::Points displacement = sensor::Points::Zero(3, markers.cols());
    constexpr Eigen::Index kTogether = 64;  // points, as their matrix is large
    for (Eigen::Index i = 0; i < count; i += kTogether) {
      const Eigen::Index some = std::min(kTogether, count - i);
      displacement.reshaped() += correction.matrix(points.middleCols(i, some)) * forces.middleCols(i, some).reshaped();
    }
    for (Eigen::Index m = 0; m < markers.cols(); ++m) {
      for (Eigen::Index i = 0; i < count; ++i) {
        displacement.col(m) += sensor::elastic::halfSpaceDisplacement(
                                   markers.col(m) - points.col(i), sensor.gel.youngsModulus, sensor.gel.poissonRatio) *
                               forces.col(i);
      }
    }
    append(all, displacement);
  }
  writeAll(job / "displacement.f64", all);
}

void surface(const path& job, const std::string& gel) {
  const sensor::Sensor sensor = loadSensor(gel);
  const Eigen::MatrixXd matrix =
      sensor::elastic::surfaceMatrix(sensor.gel, sensor::nodePositions(sensor), sensor.nodes.pitch);
  const auto forces = readAll<double>(job / "force.f64");
  const auto size = static_cast<std::size_t>(matrix.cols());
  Eigen::VectorXd moved(matrix.rows());
  std::vector<double> all;
  for (std::size_t first = 0; first + size <= forces.size(); first += size) {
    moved.noalias() = matrix * Eigen::VectorXd::Map(forces.data() + first, matrix.cols());
    append(all, moved);
  }
  writeAll(job / "surface.f64", all);
}

void points(const path& job, double least) {
  const sensor::NodeGrid grid;
  const auto count = static_cast<std::size_t>(grid.count());
  const auto fields = readAll<std::array<float, 3>>(job / "field.f32");
  std::vector<double> all;
  for (std::size_t frame = 0; 2 * count * (frame + 1) <= fields.size(); ++frame) {
    const std::array<float, 3>* const forces = fields.data() + 2 * count * frame;
    const touch::NodeForces nodes{.columns = grid.columns,
                                  .rows = grid.rows,
                                  .pitch_m = grid.pitch,
                                  .centre_m = {grid.centre.x(), grid.centre.y()},
                                  .force_N = {forces, count},
                                  .deviation_N = {forces + count, count}};
    for (const touch::CriticalPoint& each : touch::criticalPoints(nodes, least)) {
      append(all, std::array{double(frame), double(each.index), each.strength, each.angle_rad});
      append(all, each.position_m);
      append(all, each.positionDeviation_m);
      append(all, each.betweenNodes_m);
    }
  }
  writeAll(job / "points.f64", all);
}

using Row = std::array<double, 24>;

touch::Observation observationOf(const Row& row) {
  touch::Observation seen{.position_m = {row[2], row[3]},
                          .positionDeviation_m = {row[4], row[5]},
                          .force_N = {row[6], row[7], row[8]},
                          .forceDeviation_N = {row[9], row[10], row[11]},
                          .area_m2 = row[12],
                          .areaDeviation_m2 = row[13],
                          .moment_Nm = {0.0, 0.0, row[16]},
                          .halfAxes_m = {row[18], row[19]},
                          .halfAxesDeviation_m = {row[20], row[21]},
                          .orientation_rad = row[22],
                          .orientationDeviation_rad = row[23],
                          .shearSpreadRatio = row[14],
                          .shearSpreadRatioDeviation = row[15]};
  seen.momentCovariance_N2m2.noise[8] = row[17];
  return seen;
}

std::array<double, 10> judge(const std::vector<touch::Contact>& contacts) {
  const auto most = std::ranges::max_element(contacts, {}, [](const touch::Contact& one) { return one.force_N[2]; });
  const touch::Slip slip = most == contacts.end() ? touch::Slip{} : most->slip.value_or(touch::Slip{});
  const bool isKnown = slip.model == touch::SlipModel::kBall || slip.model == touch::SlipModel::kSliding;
  return {isKnown ? static_cast<double>(slip.state) : -1.0,
          slip.stickRatio.estimate,
          slip.stickRatio.low,
          slip.stickRatio.high,
          slip.friction.estimate,
          slip.friction.low,
          slip.friction.high,
          slip.incipient,
          slip.holdingForce_N,
          static_cast<double>(slip.model)};
}

void slip(const path& job) {
  constexpr double kBegin_s = 10.0;  // of the clock
  touch::ContactTracker tracker;
  double sequence = -1.0;
  const std::vector<Row> rows = readAll<Row>(job / "observations.f64");
  std::vector<double> all;
  for (auto row = rows.begin(); row != rows.end();) {
    if ((*row)[0] != sequence) tracker = {};
    sequence = (*row)[0];
    const double time_s = (*row)[1];
    touch::Field field;
    field.time_ns = std::llround(1e9 * (kBegin_s + time_s));
    field.valid = true;
    for (; row != rows.end() && (*row)[0] == sequence && (*row)[1] == time_s; ++row) {
      if ((*row)[8] != 0.0) field.contacts.push_back(observationOf(*row));
    }
    append(all, judge(tracker.update(field)));
  }
  writeAll(job / "slip.f64", all);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string part = argc > 2 ? argv[1] : "";
  const std::string more = argc > 3 ? argv[3] : "";
  if (part == "mechanics") return mechanics(argv[2], more), 0;
  if (part == "surface") return surface(argv[2], more), 0;
  if (part == "points") return points(argv[2], std::atof(more.c_str())), 0;
  if (part == "slip") return slip(argv[2]), 0;
  std::cerr << "evaluation_parts: mechanics, surface, points or slip, and a folder\n";
  return 64;
}

#include "daemon/solve/systematic.h"

#include "daemon/solve/linear_reading.h"
#include "daemon/solve/wrench.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/parallel.h"

#include <Eigen/Dense>

#include <cmath>

namespace tractiond::solve {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3, Eigen::RowMajor>;
using Vector18 = Eigen::Matrix<double, 18, 1>;
using Matrix18 = Eigen::Matrix<double, 18, 18>;

constexpr int kCameraNumbers = 7;

/// The camera a deviation elsewhere; nothing where that deviation is 0.
sensor::Camera strayed(const sensor::Sensor& sensor, int number) {
  sensor::Camera camera = sensor.camera;
  const sensor::Uncertainty by = sensor::deviationsOf(sensor);
  if (number < 3)
    camera.position[number] += by.position[number];
  else if (number < 6)
    camera.rotation[number - 3] += by.rotation[number - 3];
  else
    camera.focal_px *= 1.0 + by.focal * std::sqrt(1.0 - by.focalDistance * by.focalDistance);
  if (number == 2) camera.focal_px *= 1.0 + by.focal * by.focalDistance;  // what strays with the distance
  return camera;
}

/// Nine nodes across the face, and forces there that make up any wrench.
Strays ofNineNodes(const sensor::Sensor& sensor) {
  const sensor::Points all = sensor::nodePositions(sensor);
  const auto nodes = nineOf(all, sensor.nodes.columns, sensor.nodes.rows);
  Strays loads;
  loads.nodes.assign(nodes.begin(), nodes.end());
  loads.places = all(Eigen::all, loads.nodes);
  Eigen::MatrixXd wrenches(6, 3 * loads.places.cols());
  for (Eigen::Index i = 0; i < loads.places.cols(); ++i) {
    wrenches.middleCols<3>(3 * i) = unitWrenches(loads.places.col(i));
  }
  loads.forces = wrenches.completeOrthogonalDecomposition().pseudoInverse();  // a row of nodes makes no moment along it
  return loads;
}

/// Returns the columns of some nodes of the body's influence, or of one of its errors, for the gel's own modulus.
Eigen::MatrixXd bodyColumns(const sensor::Sensor& sensor, const Eigen::MatrixXd& influence,
                            const std::vector<int>& nodes) {
  Eigen::MatrixXd columns(influence.rows(), 3 * static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    columns.middleCols<3>(3 * static_cast<Eigen::Index>(i)) =
        influence.middleCols<3>(3 * static_cast<Eigen::Index>(nodes[i])) *
        (sensor.body->youngsModulus / sensor.gel.youngsModulus);
  }
  return columns;
}

/// Returns how 1 K displaces the markers in the picture [px]. The gel's sides and its mount decide on it, which nobody
/// has measured: the gel expands as if it were free, and bends as a block that is bonded to its base does. Of a gel
/// that is flat its base holds the middle: both shrink with the square of thickness over width.
Eigen::VectorXd byHeat(const sensor::Sensor& sensor) {
  constexpr double kExpansion = 3e-4;  // of silicone [1/K]
  constexpr double kBend = 1.6e-4;     // of the distance from the principal point at half the picture's width [1/K]
  constexpr double kAsFree = 0.4;      // thickness over width from which on the sides reach everywhere
  const sensor::Points markers = sensor::markerPositions(sensor);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const Eigen::Vector3d fixed =
      sensor.body ? Eigen::Vector3d(markers.rowwise().mean()) : Eigen::Vector3d(0.0, 0.0, sensor.gel.size.z());
  const Eigen::Vector3d& size = sensor.gel.size;
  const double flatness = sensor.body ? 1.0 : std::min(square(size.z() / (kAsFree * size.head<2>().minCoeff())), 1.0);
  Eigen::VectorXd moved_px(2 * markers.cols());
  for (Eigen::Index i = 0; i < markers.cols(); ++i) {
    const Eigen::Vector3d marker = markers.col(i);
    const Eigen::Vector2d away = project(marker) - sensor.camera.principal_px;
    const double bend = kBend * away.squaredNorm() / square(0.5 * sensor.camera.width);
    moved_px.segment<2>(2 * i) = flatness * (kExpansion * (project.jacobian(marker) * (marker - fixed)) + bend * away);
  }
  return moved_px;
}

/// What a force at `at` is misread by [force, moment about the place of the force], from what the wrench is.
Reading aboutPlace(const Reading& reading, const Eigen::Vector3d& at) {
  Reading result = reading;
  for (Eigen::Index i = 0; i < reading.cols(); ++i) result.col(i).tail<3>() -= at.cross(reading.col(i).head<3>());
  return result;
}

/// Adds what each marker's own depth misreads, with a weight.
/// \param readings about the place of the force
/// \param byDepth what a deviation of depth adds to the displacements under unit forces there, 2M x 3 [px/N]
void addScatter(const Readings& readings, const Eigen::Ref<const Eigen::MatrixXd>& byDepth, double weight,
                Matrix18& sum) {
  for (Eigen::Index i = 0; i < byDepth.rows(); i += 2) {
    Matrix63 misread;
    for (int axis = 0; axis < 3; ++axis) {
      misread.col(axis) = readings[axis].middleCols<2>(i) * byDepth.block<2, 1>(i, axis);
    }
    const Eigen::Map<const Vector18> each(misread.data());
    sum += weight * each * each.transpose();
  }
}

/// Returns 6 x 3 matrices, row after row, of which each marker's are random combinations.
std::vector<double> principal(const Matrix18& sum) {
  const Eigen::SelfAdjointEigenSolver<Matrix18> eigen(sum);
  const Matrix18 scaled = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return {scaled.data(), scaled.data() + scaled.size()};
}

/// Of a contact about any of the nine places; `around` and `byDepth`: of each.
std::vector<double> contactScatter(const std::vector<Readings>& around, const Eigen::MatrixXd& byDepth,
                                   const sensor::Points& places) {
  Matrix18 sum = Matrix18::Zero();
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    Readings about = around[i];
    for (Reading& each : about) each = aboutPlace(each, places.col(i));
    addScatter(about, byDepth.middleCols<3>(3 * i), 1.0 / static_cast<double>(places.cols()), sum);
  }
  return principal(sum);
}

/// Of a force that all nine places share.
std::vector<double> wholeFaceScatter(const Reading& wholeFace, const Eigen::MatrixXd& byDepth,
                                     const sensor::Points& places) {
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(byDepth.rows(), 3);
  for (Eigen::Index i = 0; i < places.cols(); ++i) mean += byDepth.middleCols<3>(3 * i);
  Matrix18 sum = Matrix18::Zero();
  const Reading about = aboutPlace(wholeFace, places.rowwise().mean());
  addScatter({about, about, about}, mean / static_cast<double>(places.cols()), 1.0, sum);
  return principal(sum);
}

/// Covariance of a wrench by the arrays of SystematicErrors for a contact, or for the whole face.
Matrix6 covarianceBy(std::span<const double> shared, std::span<const double> scatter, const Wrench& wrench,
                     const Eigen::Vector3d& at) {
  Matrix6 covariance = Matrix6::Zero();
  for (std::size_t k = 0; k < shared.size(); k += Matrix6::SizeAtCompileTime) {
    const Wrench error = Matrix6::Map(shared.data() + k) * wrench;
    covariance += error * error.transpose();
  }
  for (std::size_t k = 0; k < scatter.size(); k += Matrix63::SizeAtCompileTime) {
    Wrench error = Matrix63::Map(scatter.data() + k) * wrench.head<3>();
    error.tail<3>() += at.cross(error.head<3>());
    covariance += error * error.transpose();
  }
  return covariance;
}

}  // namespace

bool isWeighed(const sensor::Sensor& sensor) {
  const auto& made = sensor.calibration;
  return made && !made->stiffness.empty() && made->stiffness >= made->geometry;
}

Strays straysOf(const sensor::Sensor& sensor, const SolveOptions& options) {
  constexpr int kDegree = 6;       // a derivative need not be right to more than a hundredth
  constexpr double kSmall = 0.01;  // difference for derivatives
  using sensor::elastic::toImage;
  const sensor::Uncertainty by = sensor::deviationsOf(sensor);
  const sensor::Points markers = sensor::markerPositions(sensor);
  Strays strays = ofNineNodes(sensor);
  // Displacements by unit forces at the nodes [m/N].
  const auto displacement = [&](const sensor::Gel& gel, const sensor::Points& at) {
    return sensor::elastic::displacementMatrix(gel, options.model, at, strays.places, kDegree);
  };
  sensor::Sensor shallower = sensor;
  for (sensor::MarkerLayer& layer : shallower.layers) layer.depth *= 1.0 - kSmall;  // the base may be next to one
  Eigen::MatrixXd unit, shallow;
  if (sensor.body) {
    unit = bodyColumns(sensor, sensor.body->influence, strays.nodes);
  } else {
    sensor::Points both(3, 2 * markers.cols());
    both << markers, sensor::markerPositions(shallower);
    unit = displacement(sensor.gel, both);
    shallow = unit.bottomRows(3 * markers.cols());
    unit.conservativeResize(3 * markers.cols(), Eigen::NoChange);
  }
  const Eigen::MatrixXd straight = toImage(sensor, unit);  // [px/N]
  const auto add = [&](const sensor::Sensor& strayed, const Eigen::MatrixXd& moved, double deviations) {
    strays.all.emplace_back(deviations * (toImage(strayed, moved) - straight));
  };
  for (int number = 0; number < kCameraNumbers; ++number) {
    sensor::Sensor elsewhere = sensor;
    elsewhere.camera = strayed(sensor, number);
    add(elsewhere, unit, 1.0);
  }
  if (sensor.body) {
    for (const Eigen::MatrixXd& error : sensor.body->errors) {
      add(sensor, unit + bodyColumns(sensor, error, strays.nodes), 1.0);
    }
  } else {
    sensor::Sensor other = sensor;
    const double step = other.gel.poissonRatio < 0.25 ? kSmall : -kSmall;
    other.gel.poissonRatio += step;
    add(other, displacement(other.gel, markers), by.poissonRatio / step);
    other = sensor;
    other.gel.size.z() *= 1.0 + kSmall;
    // The camera stays where it is: its pose has an error of its own.
    add(sensor, displacement(other.gel, markers), by.thickness / (kSmall * sensor.gel.size.z()));

    Eigen::MatrixXd byDepth = toImage(shallower, shallow) - straight;  // [px/(N m)]
    Eigen::Index first = 0;
    for (const sensor::MarkerLayer& layer : sensor.layers) {
      const Eigen::Index rows = 2 * layer.count();
      byDepth.middleRows(first, rows) /= -kSmall * layer.depth;
      strays.all.emplace_back(Eigen::MatrixXd::Zero(straight.rows(), straight.cols()));
      strays.all.back().middleRows(first, rows) = by.layerDepth * byDepth.middleRows(first, rows);
      first += rows;
    }
    if (by.markerDepth > 0.0) strays.scatter = by.markerDepth * byDepth;
  }
  strays.heat = byHeat(sensor);
  double squares = strays.scatter.squaredNorm();
  for (std::size_t k = kCameraNumbers; k < strays.all.size(); ++k) squares += strays.all[k].squaredNorm();
  strays.displacement = std::sqrt(squares / straight.squaredNorm());
  return strays;
}

SystematicErrors systematicErrors(const sensor::Sensor& sensor, const SolveOptions& options, const Factors& factors,
                                  const Atoms& atoms, const Strays& strays) {
  SystematicErrors errors;
  errors.displacement = strays.displacement;
  std::vector<Readings> around;
  Reading wholeFace;
  sensor::elastic::inParallel(2, [&](Eigen::Index which) {
    if (which == 0) {
      around = contactReadings(sensor, factors, atoms, options.noise_px, errors.displacement, strays.nodes);
    } else {
      wholeFace = wholeFaceReading(factors, atoms, options.noise_px);
    }
  });
  const auto misread = [&](const Eigen::MatrixXd& stray, const auto& readingOf) {
    Matrix6 error = Matrix6::Zero();
    for (std::size_t i = 0; i < strays.nodes.size(); ++i) {
      const auto column = 3 * static_cast<Eigen::Index>(i);
      for (int axis = 0; axis < 3; ++axis) {
        error += readingOf(i, axis) * stray.col(column + axis) * strays.forces.row(column + axis);
      }
    }
    return error;
  };
  for (const Eigen::MatrixXd& stray : strays.all) {
    Matrix6 contact = misread(stray, [&](std::size_t i, int axis) -> const Reading& { return around[i][axis]; });
    Matrix6 whole = misread(stray, [&](std::size_t, int) -> const Reading& { return wholeFace; });
    if (isWeighed(sensor)) {  // with a contact that pressed: Young's modulus has since what makes it read right
      whole -= contact(2, 2) * Matrix6::Identity();
      contact -= contact(2, 2) * Matrix6::Identity();
    }
    errors.contact.insert(errors.contact.end(), contact.data(), contact.data() + contact.size());
    errors.wholeFace.insert(errors.wholeFace.end(), whole.data(), whole.data() + whole.size());
  }
  Matrix6 byContact = Matrix6::Zero();
  for (std::size_t i = 0; i < around.size(); ++i) {
    for (const Reading& reading : around[i]) {
      const Wrench error = aboutPlace(reading, strays.places.col(static_cast<Eigen::Index>(i))) * strays.heat;
      byContact += error * error.transpose() / static_cast<double>(3 * around.size());
    }
  }
  const Wrench onWhole = wholeFace * strays.heat;
  Matrix6::Map(errors.contactHeat.data()) = byContact;
  Matrix6::Map(errors.wholeFaceHeat.data()) = onWhole * onWhole.transpose();
  if (strays.scatter.size() != 0) {
    errors.contactScatter = contactScatter(around, strays.scatter, strays.places);
    errors.wholeFaceScatter = wholeFaceScatter(wholeFace, strays.scatter, strays.places);
  }
  return errors;
}

SystematicPart::SystematicPart(const Factors& factors, const sensor::Sensor& sensor)
    : errors_(factors.systematicErrors)
    , uncertainty_(sensor.uncertainty)
    , nodes_(sensor::nodePositions(sensor))
    , pitch_m_(sensor.nodes.pitch) {}

WrenchCovariance SystematicPart::covariance(const Wrench& wrench, std::span<const double> nodeForces_N,
                                            double heat_K) const {
  double sum = 0.0, squares = 0.0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < nodes_.cols(); ++n) {
    const double force2 = Eigen::Vector3d::Map(nodeForces_N.data() + 3 * n).squaredNorm(), force = std::sqrt(force2);
    sum += force;
    squares += force2;
    centroid += force * nodes_.col(n);
  }
  if (squares == 0.0) return {};
  const double whole = square(sum) / squares / static_cast<double>(nodes_.cols());
  const Eigen::Vector3d at = centroid / sum;
  const double force = wrench.head<3>().squaredNorm(), moment = wrench.tail<3>().squaredNorm();
  Matrix6 covariance = (uncertainty_.youngsModulus * uncertainty_.youngsModulus) * wrench * wrench.transpose();
  // What else the mechanics err by has any direction, and misplaces the force by a like share of a node's pitch.
  const double model = uncertainty_.model * uncertainty_.model;
  covariance.diagonal().head<3>().array() += model * force;
  covariance.diagonal().tail<3>().array() += model * (moment + pitch_m_ * pitch_m_ * force);
  if (whole < 1.0) covariance += (1.0 - whole) * covarianceBy(errors_.contact, errors_.contactScatter, wrench, at);
  if (whole > 0.0) covariance += whole * covarianceBy(errors_.wholeFace, errors_.wholeFaceScatter, wrench, at);
  if (heat_K > 0.0) {
    const Matrix6 contact = toPoint(-at) * Matrix6::Map(errors_.contactHeat.data()) * toPoint(-at).transpose();
    // The whole face is misread a hundred times as much: by its share of the force, not of the variance.
    covariance +=
        square(heat_K) * ((1.0 - whole) * contact + square(whole) * Matrix6::Map(errors_.wholeFaceHeat.data()));
  }
  WrenchCovariance result;
  Eigen::Map<Matrix6>(result.data()) = covariance;
  return result;
}

}  // namespace tractiond::solve

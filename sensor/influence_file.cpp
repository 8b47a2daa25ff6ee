#include "sensor/influence_file.h"

#include "base/quantile.h"
#include "sensor/numpy_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

namespace sensor {

namespace {

constexpr const char* kFormat = "traction-influence/1";
constexpr const char* kFormatFamily = "traction-influence/";
constexpr const char* kUnits = "SI";
constexpr double kUnitLength = 1e-3;  // largest deviation of a normal's length from 1

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::string shapeText(const std::vector<std::size_t>& shape) {
  std::string text;
  for (const std::size_t extent : shape) text += (text.empty() ? "" : ", ") + std::to_string(extent);
  return '(' + text + (shape.size() == 1 ? ",)" : ")");
}

/// Fails if an array has another shape.
void checkShape(NumpyFile& file, const std::string& name, const NumpyArray& array,
                const std::vector<std::size_t>& expected) {
  if (array.shape == expected) return;
  file.fail(name, "has the shape " + shapeText(array.shape) + " and not " + shapeText(expected));
}

// These read the arrays. What they return after a fault has no meaning, but the size that the counts ask for.

/// \param count number of rows; 0: any number
Points points(NumpyFile& file, const std::string& name, std::size_t count) {
  NumpyArray array = file.numbers(name);
  if (array.shape.size() != 2 || array.shape[1] != 3) {
    file.fail(name, "has the shape " + shapeText(array.shape) + " and not (any number, 3)");
  } else if (count != 0) {
    checkShape(file, name, array, {count, 3});
  }
  array.values.resize(count != 0 ? 3 * count : array.values.size() / 3 * 3);
  return Points::Map(array.values.data(), 3, static_cast<Eigen::Index>(array.values.size() / 3));
}

void checkWords(NumpyFile& file) {
  const std::string format = file.text("format");
  if (format != kFormat) {
    const bool newer = format.starts_with(kFormatFamily);
    file.fail("format", "is \"" + format + "\"" + (newer ? ", and this program knows " : " and not ") + '"' + kFormat +
                            '"' + (newer ? ": update it" : ""));
  }
  const std::string units = file.text("units");
  if (units != kUnits) file.fail("units", "is \"" + units + "\" and not \"SI\" (metres, newtons, pascals)");
}

double stiffness(NumpyFile& file) {
  const NumpyArray array = file.numbers("youngs_modulus");
  if (array.values.size() != 1) file.fail("youngs_modulus", "is not a single number");
  const double modulus = array.values.empty() ? 0.0 : array.values[0];
  if (!(modulus > 0.0)) file.fail("youngs_modulus", "is not above 0");
  return modulus;
}

Points normals(NumpyFile& file, std::size_t count) {
  Points found = points(file, "node_normals", count);
  for (Eigen::Index n = 0; n < found.cols(); ++n) {
    const double length = found.col(n).norm();
    if (std::abs(length - 1.0) > kUnitLength) {
      file.fail("node_normals[" + std::to_string(n) + "]", "has the length " + std::to_string(length) + " and not 1");
    }
    found.col(n) /= length;
  }
  const bool isInward = found.cols() > 0 && found.row(2).mean() > 0.0;
  if (!isInward) {
    file.fail("node_normals", "point out of the body: they must point into it (z > 0)");
  }
  return found;
}

Eigen::VectorXd areas(NumpyFile& file, std::size_t count) {
  NumpyArray array = file.numbers("node_areas");
  checkShape(file, "node_areas", array, {count});
  array.values.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    if (!(array.values[n] > 0.0)) file.fail("node_areas[" + std::to_string(n) + "]", "is not above 0");
  }
  return Eigen::VectorXd::Map(array.values.data(), static_cast<Eigen::Index>(count));
}

Eigen::MatrixXd influence(NumpyFile& file, std::size_t markers, std::size_t nodes) {
  const NumpyArray array = file.numbers("influence");
  const std::vector<std::size_t> flat = {3 * markers, 3 * nodes}, whole = {markers, 3, nodes, 3};
  if (array.shape != flat && array.shape != whole) {
    file.fail("influence", "has the shape " + shapeText(array.shape) + " and not " + shapeText(whole) + " or " +
                               shapeText(flat) + ", as marker_positions and node_positions ask for");
    return {};
  }
  if (std::all_of(array.values.begin(), array.values.end(), [](double x) { return x == 0.0; })) {
    file.fail("influence", "is all zero");
  }
  return RowMajor::Map(array.values.data(), static_cast<Eigen::Index>(flat[0]), static_cast<Eigen::Index>(flat[1]));
}

/// Reads the changes of the influence; none if the file has no such array.
std::vector<Eigen::MatrixXd> influenceErrors(NumpyFile& file, std::size_t markers, std::size_t nodes) {
  constexpr const char* kName = "influence_errors";
  std::vector<Eigen::MatrixXd> errors;
  if (!file.has(kName)) return errors;
  const NumpyArray array = file.numbers(kName);
  const std::size_t count = array.shape.empty() ? 0 : array.shape.front();
  const std::vector<std::size_t> expected = {count, markers, 3, nodes, 3};
  checkShape(file, kName, array, expected);
  if (array.shape != expected) return errors;
  const auto rows = static_cast<Eigen::Index>(3 * markers), columns = static_cast<Eigen::Index>(3 * nodes);
  for (std::size_t k = 0; k < count; ++k) {
    errors.emplace_back(
        RowMajor::Map(array.values.data() + static_cast<Eigen::Index>(k) * rows * columns, rows, columns));
  }
  return errors;
}

/// Returns the median over the nodes of E * distance * (displacement per force), for the marker nearest to each node;
/// the displacement along the force is averaged over the three axes. It is about 1/3 under the surface of a half-space,
/// less near a bonded face, and larger in a thin shell.
double compliance(const Body& body) {
  std::vector<double> all;
  for (Eigen::Index n = 0; n < body.nodes.cols(); ++n) {
    Eigen::Index m = 0;
    const double distance =
        std::sqrt((body.markers.colwise() - body.nodes.col(n)).colwise().squaredNorm().minCoeff(&m));
    if (distance > 0.0) {
      all.push_back(body.influence.block<3, 3>(3 * m, 3 * n).trace() / 3.0 * body.youngsModulus * distance);
    }
  }
  if (all.empty()) return 1.0;
  return tractiond::quantile(all);
}

/// Fails if the matrix has the wrong sign or unit.
void checkCompliance(NumpyFile& file, const Body& body) {
  constexpr double kLeast = 1e-3, kMost = 100.0;
  const double found = compliance(body);
  if (found <= 0.0) {
    file.fail("influence", "moves the markers against the force: it must hold the displacements by forces on the body, "
                           "both in the gel frame");
  }
  if (found >= kLeast && found <= kMost) return;
  std::array<char, 32> factor{};
  std::snprintf(factor.data(), factor.size(), "%.0e", found);
  file.fail("influence", std::string("moves the markers by ") + factor.data() +
                             " of force / (youngs_modulus distance), and no body does: it must hold metres per newton");
}

/// Returns the mean distance of neighbours in the grid [m].
double meanPitch(const Points& points, Eigen::Index first, int columns, int rows) {
  double sum = 0.0;
  int count = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Index here = first + row * columns + column;
      for (const int back : {column > 0 ? 1 : 0, row > 0 ? columns : 0}) {
        if (back == 0) continue;
        sum += (points.col(here) - points.col(here - back)).norm();
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace

tl::expected<Body, FileError> loadBody(const std::string& path) {
  auto file = NumpyFile::load(path);
  if (!file) return tl::unexpected(file.error());
  Body body;
  body.file = path;
  checkWords(*file);
  body.youngsModulus = stiffness(*file);
  body.nodes = points(*file, "node_positions", 0);
  body.markers = points(*file, "marker_positions", 0);
  const auto nodes = static_cast<std::size_t>(body.nodes.cols()),
             markers = static_cast<std::size_t>(body.markers.cols());
  body.normals = normals(*file, nodes);
  body.areas = areas(*file, nodes);
  body.influence = influence(*file, markers, nodes);
  body.errors = influenceErrors(*file, markers, nodes);
  if (auto sound = file->finish(); !sound) return tl::unexpected(sound.error());
  checkCompliance(*file, body);
  if (auto sound = file->finish(); !sound) return tl::unexpected(sound.error());
  return body;
}

tl::expected<void, FileError> setBody(Sensor& sensor, Body body) {
  const auto bad = [&body](const std::string& what) {
    return tl::unexpected(FileError{.where = body.file, .what = what, .isData = true});
  };
  if (body.nodes.cols() != sensor.nodes.count()) {
    return bad("node_positions holds " + std::to_string(body.nodes.cols()) + " nodes, and the gel file's [nodes] has " +
               std::to_string(sensor.nodes.columns) + " x " + std::to_string(sensor.nodes.rows));
  }
  if (body.markers.cols() != sensor.markerCount()) {
    return bad("marker_positions holds " + std::to_string(body.markers.cols()) +
               " markers, and the gel file's [[layers]] have " + std::to_string(sensor.markerCount()));
  }
  for (Eigen::Index m = 0; m < body.markers.cols(); ++m) {
    if (body.markers(2, m) < sensor.gel.size.z()) continue;
    return bad("marker_positions[" + std::to_string(m) + "] has z = " + std::to_string(body.markers(2, m)) +
               " m, and the gel file's thickness_mm ends the gel at " + std::to_string(sensor.gel.size.z()) + " m");
  }
  sensor.nodes.pitch = std::sqrt(body.areas.mean());
  sensor.nodes.centre = body.nodes.topRows<2>().rowwise().mean();
  Eigen::Index first = 0;
  for (MarkerLayer& layer : sensor.layers) {
    const Eigen::Vector3d middle = body.markers.middleCols(first, layer.count()).rowwise().mean();
    layer.pitch = meanPitch(body.markers, first, layer.columns, layer.rows);
    layer.centre = middle.head<2>();
    layer.depth = middle.z();
    first += layer.count();
  }
  sensor.body = std::make_shared<const Body>(std::move(body));
  return {};
}

}  // namespace sensor

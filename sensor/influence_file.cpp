#include "sensor/influence_file.h"

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

FileError wrongShape(const NumpyFile& file, const std::string& name, const NumpyArray& array,
                     const std::vector<std::size_t>& expected) {
  return file.fault(name, "has the shape " + shapeText(array.shape) + " and not " + shapeText(expected));
}

/// Reads an array of points. \param count number of rows; 0: any number
tl::expected<Points, FileError> points(const NumpyFile& file, const std::string& name, std::size_t count) {
  const auto array = file.numbers(name);
  if (!array) return tl::unexpected(array.error());
  if (array->shape.size() != 2 || array->shape[1] != 3) {
    return tl::unexpected(file.fault(name, "has the shape " + shapeText(array->shape) + " and not (any number, 3)"));
  }
  if (count != 0 && array->shape[0] != count) return tl::unexpected(wrongShape(file, name, *array, {count, 3}));
  return Points(Points::Map(array->values.data(), 3, static_cast<Eigen::Index>(array->shape[0])));
}

tl::expected<void, FileError> checkWords(const NumpyFile& file) {
  const auto format = file.text("format");
  if (!format) return tl::unexpected(format.error());
  if (*format != kFormat) {
    const bool newer = format->starts_with(kFormatFamily);
    return tl::unexpected(file.fault("format", "is \"" + *format + "\"" +
                                                   (newer ? ", and this program knows " : " and not ") + '"' + kFormat +
                                                   '"' + (newer ? ": update it" : "")));
  }
  const auto units = file.text("units");
  if (!units) return tl::unexpected(units.error());
  if (*units != kUnits) {
    return tl::unexpected(file.fault("units", "is \"" + *units + "\" and not \"SI\" (metres, newtons, pascals)"));
  }
  return {};
}

tl::expected<double, FileError> stiffness(const NumpyFile& file) {
  const auto array = file.numbers("youngs_modulus");
  if (!array) return tl::unexpected(array.error());
  if (array->values.size() != 1) return tl::unexpected(file.fault("youngs_modulus", "is not a single number"));
  if (!(array->values[0] > 0.0)) return tl::unexpected(file.fault("youngs_modulus", "is not above 0"));
  return array->values[0];
}

tl::expected<Points, FileError> normals(const NumpyFile& file, std::size_t count) {
  auto found = points(file, "node_normals", count);
  if (!found) return found;
  for (Eigen::Index n = 0; n < found->cols(); ++n) {
    const double length = found->col(n).norm();
    if (std::abs(length - 1.0) > kUnitLength) {
      return tl::unexpected(file.fault("node_normals[" + std::to_string(n) + "]",
                                       "has the length " + std::to_string(length) + " and not 1"));
    }
    found->col(n) /= length;
  }
  if (found->row(2).mean() <= 0.0) {
    return tl::unexpected(file.fault("node_normals", "point out of the body: they must point into it (z > 0)"));
  }
  return found;
}

tl::expected<Eigen::VectorXd, FileError> areas(const NumpyFile& file, std::size_t count) {
  const auto array = file.numbers("node_areas");
  if (!array) return tl::unexpected(array.error());
  if (array->shape != std::vector{count}) return tl::unexpected(wrongShape(file, "node_areas", *array, {count}));
  for (std::size_t n = 0; n < count; ++n) {
    if (array->values[n] > 0.0) continue;
    return tl::unexpected(file.fault("node_areas[" + std::to_string(n) + "]", "is not above 0"));
  }
  return Eigen::VectorXd(Eigen::VectorXd::Map(array->values.data(), static_cast<Eigen::Index>(count)));
}

tl::expected<Eigen::MatrixXd, FileError> influence(const NumpyFile& file, std::size_t markers, std::size_t nodes) {
  const auto array = file.numbers("influence");
  if (!array) return tl::unexpected(array.error());
  const std::vector<std::size_t> flat = {3 * markers, 3 * nodes}, whole = {markers, 3, nodes, 3};
  if (array->shape != flat && array->shape != whole) {
    return tl::unexpected(file.fault("influence", "has the shape " + shapeText(array->shape) + " and not " +
                                                      shapeText(whole) + " or " + shapeText(flat) +
                                                      ", as marker_positions and node_positions ask for"));
  }
  if (std::all_of(array->values.begin(), array->values.end(), [](double x) { return x == 0.0; })) {
    return tl::unexpected(file.fault("influence", "is all zero"));
  }
  return Eigen::MatrixXd(
      RowMajor::Map(array->values.data(), static_cast<Eigen::Index>(flat[0]), static_cast<Eigen::Index>(flat[1])));
}

/// Reads the changes of the influence; none if the file has no such array.
tl::expected<std::vector<Eigen::MatrixXd>, FileError> influenceErrors(const NumpyFile& file, std::size_t markers,
                                                                      std::size_t nodes) {
  constexpr const char* kName = "influence_errors";
  std::vector<Eigen::MatrixXd> errors;
  if (!file.has(kName)) return errors;
  const auto array = file.numbers(kName);
  if (!array) return tl::unexpected(array.error());
  const std::size_t count = array->shape.empty() ? 0 : array->shape.front();
  const std::vector<std::size_t> expected = {count, markers, 3, nodes, 3};
  if (array->shape != expected) return tl::unexpected(wrongShape(file, kName, *array, expected));
  const auto rows = static_cast<Eigen::Index>(3 * markers), columns = static_cast<Eigen::Index>(3 * nodes);
  for (std::size_t k = 0; k < count; ++k) {
    errors.emplace_back(
        RowMajor::Map(array->values.data() + static_cast<Eigen::Index>(k) * rows * columns, rows, columns));
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
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

/// Fails if the matrix has the wrong sign or unit.
tl::expected<void, FileError> checkCompliance(const NumpyFile& file, const Body& body) {
  constexpr double kLeast = 1e-3, kMost = 100.0;
  const double found = compliance(body);
  if (found <= 0.0) {
    return tl::unexpected(file.fault("influence", "moves the markers against the force: it must hold the displacements "
                                                  "by forces on the body, both in the gel frame"));
  }
  if (found >= kLeast && found <= kMost) return {};
  std::array<char, 32> factor{};
  std::snprintf(factor.data(), factor.size(), "%.0e", found);
  return tl::unexpected(file.fault("influence", std::string("moves the markers by ") + factor.data() +
                                                    " of force / (youngs_modulus distance), and no body does: it must "
                                                    "hold metres per newton"));
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
  const auto file = NumpyFile::load(path);
  if (!file) return tl::unexpected(file.error());
  if (auto sound = checkWords(*file); !sound) return tl::unexpected(sound.error());
  const auto modulus = stiffness(*file);
  if (!modulus) return tl::unexpected(modulus.error());
  auto nodes = points(*file, "node_positions", 0);
  if (!nodes) return tl::unexpected(nodes.error());
  auto markers = points(*file, "marker_positions", 0);
  if (!markers) return tl::unexpected(markers.error());
  const auto nodeCount = static_cast<std::size_t>(nodes->cols()),
             markerCount = static_cast<std::size_t>(markers->cols());
  auto inward = normals(*file, nodeCount);
  if (!inward) return tl::unexpected(inward.error());
  auto surface = areas(*file, nodeCount);
  if (!surface) return tl::unexpected(surface.error());
  auto matrix = influence(*file, markerCount, nodeCount);
  if (!matrix) return tl::unexpected(matrix.error());
  auto errors = influenceErrors(*file, markerCount, nodeCount);
  if (!errors) return tl::unexpected(errors.error());
  Body body{.file = path,
            .youngsModulus = *modulus,
            .influence = *std::move(matrix),
            .nodes = *std::move(nodes),
            .normals = *std::move(inward),
            .areas = *std::move(surface),
            .markers = *std::move(markers),
            .errors = *std::move(errors)};
  if (auto sound = checkCompliance(*file, body); !sound) return tl::unexpected(sound.error());
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

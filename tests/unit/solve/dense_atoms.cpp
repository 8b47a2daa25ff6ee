#include "tests/unit/solve/dense_atoms.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::solve {

sensor::Points DenseAtoms::pointsOf(const sensor::NodeGrid& nodes) {
  sensor::Points points(3, (nodes.columns + 4) * (nodes.rows + 4));
  Eigen::Index p = 0;
  for (int row = -2; row < nodes.rows + 2; ++row) {
    for (int column = -2; column < nodes.columns + 2; ++column) points.col(p++) = nodes.position(column, row);
  }
  return points;
}

DenseAtoms::Matrix DenseAtoms::kronecker(const Matrix& shape) {
  Matrix result = Matrix::Zero(3 * shape.rows(), 3 * shape.cols());
  for (Eigen::Index p = 0; p < shape.rows(); ++p) {
    for (Eigen::Index a = 0; a < shape.cols(); ++a) {
      result.block<3, 3>(3 * p, 3 * a) = shape(p, a) * Eigen::Matrix3d::Identity();
    }
  }
  return result;
}

DenseAtoms::DenseAtoms(const sensor::NodeGrid& nodes) {
  points_ = pointsOf(nodes);
  std::vector<Vector> shapes;
  const auto add = [&](const Vector& shape, double x, double y, int level) {
    shapes.push_back(shape / shape.sum());
    x_.push_back(x);
    y_.push_back(y);
    level_.push_back(level);
  };
  for (Eigen::Index p = 0; p < points_.cols(); ++p) {
    add(Vector::Unit(points_.cols(), p), points_(0, p), points_(1, p), 0);
  }
  spacing_ = {nodes.pitch};
  const double halfX = nodes.pitch * (nodes.columns - 1) / 2, halfY = nodes.pitch * (nodes.rows - 1) / 2;
  for (const int scale : {2, 4, 8}) {
    const double width = scale * nodes.pitch;
    // No hat's centre is further out than a pitch.
    const int across = static_cast<int>(std::floor((halfX + nodes.pitch + 1e-6) / width));
    const int along = static_cast<int>(std::floor((halfY + nodes.pitch + 1e-6) / width));
    for (int j = -along; j <= along; ++j) {
      for (int i = -across; i <= across; ++i) {
        const double x = nodes.centre.x() + i * width, y = nodes.centre.y() + j * width;
        Vector shape(points_.cols());
        for (Eigen::Index p = 0; p < points_.cols(); ++p) {
          const double dx = std::abs(points_(0, p) - x), dy = std::abs(points_(1, p) - y);
          const bool inside = std::abs(points_(0, p) - nodes.centre.x()) < halfX + 1e-6 &&
                              std::abs(points_(1, p) - nodes.centre.y()) < halfY + 1e-6;
          shape[p] = inside ? std::max(0.0, 1 - dx / width) * std::max(0.0, 1 - dy / width) : 0.0;
        }
        add(shape, x, y, static_cast<int>(spacing_.size()));
      }
    }
    spacing_.push_back(width);
  }
  Vector even(points_.cols());
  for (Eigen::Index p = 0; p < points_.cols(); ++p) {
    even[p] = std::abs(points_(0, p) - nodes.centre.x()) < halfX + 1e-6 &&
              std::abs(points_(1, p) - nodes.centre.y()) < halfY + 1e-6;
  }
  add(even, nodes.centre.x(), nodes.centre.y(), static_cast<int>(spacing_.size()));
  spacing_.push_back(nodes.pitch * std::max(nodes.columns, nodes.rows));
  plate_ = static_cast<Eigen::Index>(shapes.size()) - 1;
  // Lines: each side of the rectangles through the outermost nodes, a pitch outside of them, and two, in parts.
  const double broad = 8 * nodes.pitch;
  for (int ring = 0; ring < 3; ++ring) {
    for (int side = 0; side < 4; ++side) {
      const bool alongX = side < 2;
      const double half = alongX ? halfX : halfY;
      const double at = (side % 2 == 0 ? -1 : 1) * ((alongX ? halfY : halfX) + ring * nodes.pitch);
      const int parts = static_cast<int>(std::floor((half + nodes.pitch + 1e-6) / broad));
      for (int part = -parts; part <= parts; ++part) {
        Vector shape = Vector::Zero(points_.cols());
        for (Eigen::Index p = 0; p < points_.cols(); ++p) {
          const double u = points_(0, p) - nodes.centre.x(), v = points_(1, p) - nodes.centre.y();
          const double on = alongX ? u : v, off = alongX ? v : u;
          if (std::abs(off - at) > 1e-6 || std::abs(on) > half + 1e-6) continue;
          shape[p] = std::max(0.0, 1 - std::abs(on - part * broad) / broad);
        }
        add(shape, nodes.centre.x() + (alongX ? part * broad : at), nodes.centre.y() + (alongX ? at : part * broad),
            static_cast<int>(spacing_.size()));
      }
    }
  }
  spacing_.push_back(broad);
  beyond_ = even.array() == 0.0;
  for (Eigen::Index p = 0; p < points_.cols(); ++p) {
    Eigen::Index node = 0;
    double least = std::numeric_limits<double>::max();
    for (Eigen::Index q = 0; q < points_.cols(); ++q) {
      const double away = (points_.col(p) - points_.col(q)).norm();
      if (beyond_[q] || away >= least) continue;
      least = away;
      node = q;
    }
    nearest_.push_back(node);
  }
  shape_.resize(points_.cols(), static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t a = 0; a < shapes.size(); ++a) shape_.col(static_cast<Eigen::Index>(a)) = shapes[a];
}

double DenseAtoms::squaredDistance(std::size_t a, std::size_t b) const {
  return (x_[a] - x_[b]) * (x_[a] - x_[b]) + (y_[a] - y_[b]) * (y_[a] - y_[b]);
}

}  // namespace tractiond::solve

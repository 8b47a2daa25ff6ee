// Flooding from the peaks down: the nodes, strongest first, each join the hill of a neighbour that is there already, or
// begin one. Where two hills meet, the lower one stays a contact of its own if the forces fall between the two peaks,
// by more than the noise and by more than a share; otherwise it becomes part of the other. The noise of neighbouring
// nodes is opposed, so sums of a few are known far better than each: the fall is that of sums across the line from peak
// to peak, which takes nothing from the resolution along it.
#include "daemon/solve/contacts.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// What separates two contacts: the fall between them in standard deviations, of the lower peak and of the higher one.
constexpr double kFall_deviations = 2.5;
constexpr double kFall_lower = 0.25;
constexpr double kFall_higher = 0.08;

/// Half width of the sums across the line between two peaks [pitches].
constexpr double kHalfWidth = 1.6;

/// A hill whose force is below so many of its standard deviations is no contact.
constexpr double kLeast_deviations = 5.0;

double square(double x) {
  return x * x;
}

}  // namespace

Contacts::Contacts(const sensor::Sensor& sensor)
    : grid_(sensor.nodes)
    , positions_(sensor::nodePositions(sensor))
    , normals_(sensor::nodeNormals(sensor))
    , areas_(sensor::nodeAreas(sensor))
    , indexAt_(static_cast<std::size_t>(sensor.nodes.count()), -1) {
  constexpr std::size_t kNodes = ContactStep::kMostNodes;
  for (auto* each : {&order_, &hill_, &peak_, &parent_}) each->reserve(kNodes);
  magnitude_.reserve(kNodes);
  functional_.resize(ContactStep::kMostUnknowns);
}

int Contacts::hillOf(int index) {
  int hill = hill_[index];
  while (parent_[hill] != hill) hill = parent_[hill];
  return hill;
}

double Contacts::deviation(const ContactStep& step) {
  step.prepare(functional_.data());
  return std::sqrt(step.covariance(functional_.data(), functional_.data()));
}

/// The forces along `direction` in a strip across the line from node `from` (unit step `along`, in pitches), at a
/// distance `at` on that line: nodes count linearly less up to a pitch from it. Adds `factor` times that functional.
double Contacts::strip(const ContactStep& step, int from, const Eigen::Vector2d& along, double at,
                       const Eigen::Vector3d& direction, double factor) {
  const auto nodes = step.nodes();
  const int row = nodes[from] / grid_.columns, column = nodes[from] % grid_.columns;
  double sum = 0.0;
  for (int j = 0; j < static_cast<int>(nodes.size()); ++j) {
    const Eigen::Vector2d offset(nodes[j] % grid_.columns - column, nodes[j] / grid_.columns - row);
    const double weight = 1.0 - std::abs(along.dot(offset) - at);
    if (weight <= 0.0 || std::abs(along.x() * offset.y() - along.y() * offset.x()) > kHalfWidth) continue;
    for (int axis = 0; axis < 3; ++axis) {
      functional_[3 * j + axis] += factor * weight * direction[axis];
      sum += weight * direction[axis] * step.forces()[3 * j + axis];
    }
  }
  return sum;
}

bool Contacts::apart(const ContactStep& step, int lower, int higher) {
  const auto nodes = step.nodes();
  const auto force = [&](int i) { return Eigen::Vector3d::Map(step.forces().data() + 3 * i); };
  const Eigen::Vector3d direction = (force(lower) + force(higher)).normalized();
  Eigen::Vector2d along(nodes[higher] % grid_.columns - nodes[lower] % grid_.columns,
                        nodes[higher] / grid_.columns - nodes[lower] / grid_.columns);
  const double length = along.norm();
  if (length < 1.5) return false;  // neighbours
  along /= length;
  const auto height = [&](double at, double factor) { return strip(step, lower, along, at, direction, factor); };
  const double low = height(0.0, 0.0), high = height(length, 0.0);
  for (double at = 0.5; at <= length - 0.5; at += 0.5) {
    const double fall = low - height(at, 0.0);
    if (fall < kFall_lower * low || fall < kFall_higher * high) continue;
    std::fill(functional_.begin(), functional_.end(), 0.0);
    height(0.0, 1.0);
    height(at, -1.0);
    if (fall > kFall_deviations * deviation(step)) return true;
  }
  return false;
}

/// Calls use(j) for the step's nodes next to node i of the step.
template <typename Use>
void Contacts::around(const ContactStep& step, int i, Use use) const {
  const int row = step.nodes()[i] / grid_.columns, column = step.nodes()[i] % grid_.columns;
  for (int r = std::max(0, row - 1); r <= std::min(grid_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(grid_.columns - 1, column + 1); ++c) {
      const int j = indexAt_[r * grid_.columns + c];
      if (j >= 0 && j != i) use(j);
    }
  }
}

void Contacts::divide(const ContactStep& step) {
  const auto nodes = step.nodes();
  const auto count = static_cast<int>(nodes.size());
  magnitude_.clear();
  order_.clear();
  for (int i = 0; i < count; ++i) {
    const auto f = step.forces().subspan(3 * i, 3);
    magnitude_.push_back(std::sqrt(square(f[0]) + square(f[1]) + square(f[2])));
    order_.push_back(i);
    indexAt_[nodes[i]] = i;
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) { return magnitude_[a] > magnitude_[b]; });

  hill_.assign(static_cast<std::size_t>(count), -1);
  peak_.clear();
  parent_.clear();
  for (const int i : order_) {
    around(step, i, [&](int neighbour) {
      if (hill_[neighbour] < 0) return;
      const int other = hillOf(neighbour);
      if (hill_[i] < 0) hill_[i] = other;
      const int own = hillOf(i);
      if (own == other) return;
      const bool ownIsHigher = magnitude_[peak_[own]] > magnitude_[peak_[other]];
      const int higher = ownIsHigher ? own : other, lower = ownIsHigher ? other : own;
      if (!apart(step, peak_[lower], peak_[higher])) parent_[lower] = higher;
    });
    if (hill_[i] >= 0) continue;
    hill_[i] = static_cast<int>(peak_.size());
    parent_.push_back(hill_[i]);
    peak_.push_back(i);
  }
  for (const int node : nodes) indexAt_[node] = -1;
}

Contact Contacts::describe(const ContactStep& step, int hill) {
  const auto nodes = step.nodes();
  const auto forces = step.forces();
  const auto count = static_cast<int>(nodes.size());
  Contact contact;
  double sum = 0.0, squares = 0.0;  // of the forces; squares by area
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const auto functional = [&](auto value) {
    std::fill(functional_.begin(), functional_.end(), 0.0);
    for (int i = 0; i < count; ++i) {
      if (hillOf(i) == hill) value(i, functional_.data() + 3 * i);
    }
  };
  functional([&](int i, double*) {
    for (int axis = 0; axis < 3; ++axis) contact.force_N[axis] += forces[3 * i + axis];
    sum += magnitude_[i];
    squares += square(magnitude_[i]) / areas_[nodes[i]];
    normal += magnitude_[i] * normals_.col(nodes[i]);
  });
  normal.normalize();
  for (int axis = 0; axis < 3; ++axis) {
    functional([&](int, double* f) { f[axis] = 1.0; });
    contact.forceDeviation_N[axis] = deviation(step);
  }

  // The centre of what presses, or, where nothing does, of all forces along their sum.
  const auto force = Eigen::Vector3d::Map(contact.force_N.data());
  const auto deviations = Eigen::Vector3d::Map(contact.forceDeviation_N.data());
  const bool presses = normal.dot(force) > 5.0 * normal.cwiseProduct(deviations).norm();
  const Eigen::Vector3d along = presses ? normal : force.normalized();
  const double total = along.dot(force);
  for (int axis = 0; axis < 2; ++axis) {
    double moment = 0.0;
    functional([&](int i, double*) {
      for (int k = 0; k < 3; ++k) moment += positions_(axis, nodes[i]) * along[k] * forces[3 * i + k];
    });
    contact.position_m[axis] = moment / total;
    functional([&](int i, double* f) {
      for (int k = 0; k < 3; ++k) f[k] = along[k] * (positions_(axis, nodes[i]) - contact.position_m[axis]) / total;
    });
    contact.positionDeviation_m[axis] = deviation(step);
  }

  contact.area_m2 = square(sum) / squares;
  functional([&](int i, double* f) {
    for (int k = 0; k < 3; ++k) {
      f[k] = 2.0 * contact.area_m2 * (1.0 / sum - magnitude_[i] / areas_[nodes[i]] / squares) * forces[3 * i + k] /
             magnitude_[i];
    }
  });
  contact.areaDeviation_m2 = deviation(step);
  return contact;
}

int Contacts::list(const ContactStep& step, std::array<Contact, kMaxContacts>& contacts) {
  divide(step);
  const auto strength = [](const Contact& contact) {
    return square(contact.force_N[0]) + square(contact.force_N[1]) + square(contact.force_N[2]);
  };
  int count = 0;
  for (int hill = 0; hill < static_cast<int>(peak_.size()); ++hill) {  // highest peak first
    if (parent_[hill] != hill || count == kMaxContacts) continue;
    const Contact contact = describe(step, hill);
    double deviations = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      deviations = std::max(deviations, std::abs(contact.force_N[axis]) / contact.forceDeviation_N[axis]);
    }
    if (deviations > kLeast_deviations) contacts[count++] = contact;
  }
  std::sort(contacts.begin(), contacts.begin() + count,
            [&](const Contact& a, const Contact& b) { return strength(a) > strength(b); });
  return count;
}

}  // namespace tractiond::solve

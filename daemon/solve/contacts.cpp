// Flooding from the peaks down: the nodes, strongest first, each join the hill of a neighbour that is there already, or
// begin one. Where two hills meet, the lower one stays a contact of its own if its peak rises above the saddle by more
// than the noise of their difference and by more than a share of itself; otherwise it becomes part of the other.
#include "daemon/solve/contacts.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// What separates two contacts: rise of the lower peak above the saddle, in standard deviations and of the peak.
constexpr double kRise_deviations = 4.0;
constexpr double kRise_peak = 0.3;

/// A hill whose force is below so many of its standard deviations is no contact.
constexpr double kLeast_deviations = 3.0;

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

bool Contacts::apart(const ContactStep& step, int peak, int saddle) {
  const double rise = magnitude_[peak] - magnitude_[saddle];
  if (rise < kRise_peak * magnitude_[peak]) return false;
  std::fill(functional_.begin(), functional_.end(), 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const double direction = step.forces()[3 * peak + axis] / magnitude_[peak];
    functional_[3 * peak + axis] += direction;
    functional_[3 * saddle + axis] -= direction;
  }
  return rise > kRise_deviations * deviation(step);
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
    const int row = nodes[i] / grid_.columns, column = nodes[i] % grid_.columns;
    for (int r = std::max(0, row - 1); r <= std::min(grid_.rows - 1, row + 1); ++r) {
      for (int c = std::max(0, column - 1); c <= std::min(grid_.columns - 1, column + 1); ++c) {
        const int neighbour = indexAt_[r * grid_.columns + c];
        if (neighbour < 0 || neighbour == i || hill_[neighbour] < 0) continue;
        const int other = hillOf(neighbour);
        if (hill_[i] < 0) {
          hill_[i] = other;
          continue;
        }
        const int own = hillOf(i);
        if (own == other) continue;
        const bool ownIsHigher = magnitude_[peak_[own]] > magnitude_[peak_[other]];
        const int higher = ownIsHigher ? own : other, lower = ownIsHigher ? other : own;
        if (!apart(step, peak_[lower], i)) parent_[lower] = higher;
      }
    }
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

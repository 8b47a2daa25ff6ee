// Tells the contacts of one frame apart.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/contact_step.h"
#include "sensor/sensor.h"

#include <array>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Contacts {
 public:
  explicit Contacts(const sensor::Sensor& sensor);

  /// Lists the contacts of what `step` solved, strongest first, at most kMaxContacts. Returns their number.
  int list(const ContactStep& step, std::array<Contact, kMaxContacts>& contacts);

 private:
  void divide(const ContactStep& step);
  template <typename Use>
  void around(const ContactStep& step, int i, Use use) const;
  double strip(const ContactStep& step, int from, const Eigen::Vector2d& along, double at,
               const Eigen::Vector3d& direction, double factor);
  bool apart(const ContactStep& step, int lower, int higher);
  Contact describe(const ContactStep& step, int hill);
  double deviation(const ContactStep& step);
  int hillOf(int index);

  const sensor::NodeGrid grid_;  ///< who is whose neighbour
  const sensor::Points positions_, normals_;
  const Eigen::VectorXd areas_;
  std::vector<int> indexAt_;        ///< of every node of the grid among the step's, -1: none
  std::vector<double> magnitude_;   ///< of the step's forces
  std::vector<int> order_, hill_;   ///< of the step's nodes: strongest first; the hill each belongs to
  std::vector<int> peak_, parent_;  ///< of each hill: its highest node; itself, or the hill it was merged into
  std::vector<double> functional_;
};

}  // namespace tractiond::solve

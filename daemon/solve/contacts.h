// Tells the contacts of one frame apart.
#pragma once

#include "daemon/solve/contact_step.h"
#include "daemon/solve/hills.h"
#include "daemon/solve/off_grid.h"
#include "daemon/solve/patch_fit.h"
#include "sensor/sensor.h"

#include <array>
#include <optional>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Contacts {
 public:
  Contacts(const Inverse& inverse, const sensor::Sensor& sensor);

  /// Lists the contacts of what `step` solved from `picture`, strongest first, at most kMaxContacts. Returns their
  /// number. A lone contact near the rim of the nodes is solved for again, around the patch that it looks like, as far
  /// as the step is trusted: `trust` 0 leaves the step as it is, 1 trusts it wholly.
  int list(ContactStep& step, const Picture& picture, double trust, std::array<Contact, kMaxContacts>& contacts);

  /// What the last list() solved around.
  struct AtRim {
    double share = 0.0;  ///< how far it was expected; 0: nothing was
    Patch patch;
    Eigen::Matrix<double, 6, 6> covariance;  ///< as PatchFit's
  };
  const AtRim& atRim() const { return atRim_; }

 private:
  /// A contact of the hills as a place and a force on the grid of the nodes.
  struct Hill {
    Eigen::Vector2d centre{0.0, 0.0};  ///< column, row [pitches]
    Eigen::Vector2d half{0.0, 0.0};    ///< from its centre to either end, if it is two points [pitches]
    Eigen::Vector3d direction;         ///< of its force
  };
  Hill survey(const ContactStep& step, int hill);
  bool resolve(const ContactStep& step, const Picture& picture, std::span<const Hill> hills, bool split);
  bool isPair(int first, const Eigen::Vector3d& direction) const;
  Contact describe(const Patch& patch, const Eigen::Matrix<double, 6, 6>& covariance) const;
  void solveAtRim(ContactStep& step, const Picture& picture, const Hill& hill, double certainty);

  const sensor::NodeGrid grid_;
  const sensor::Points positions_;
  const Eigen::VectorXd areas_;
  Hills hills_;
  PatchFit fit_;
  std::optional<OffGrid> offGrid_;  ///< none: no flat block
  std::vector<double> expected_;    ///< forces of the step's nodes
  LineArray<double> nearly_;        ///< a picture
  AtRim atRim_;
  // What resolve() found.
  std::array<Patch, PatchFit::kMostPatches> patches_;
  std::array<Contact, PatchFit::kMostPatches> resolved_;
  int patchCount_ = 0;
};

}  // namespace tractiond::solve

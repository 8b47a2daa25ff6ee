// Separates the contacts of one frame.
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
  /// `inverse` must outlive it; `sensor` is the one it was computed for.
  Contacts(const Inverse& inverse, const sensor::Sensor& sensor);

  /// Lists the contacts in the forces that `step` solved from `picture`, strongest first, at most kMaxContacts: the
  /// hills with a surety() above Hills::kLeast_deviations, or the patches that explain them better. Returns their
  /// number, which may be 0. A single contact near the rim of the nodes is solved for again in `step`, with the forces
  /// of a fitted patch as its prior mean. \param trust weight of the step, 0 to 1: 0 leaves it as it is
  int list(ContactStep& step, const Picture& picture, double trust, std::array<Contact, kMaxContacts>& contacts);

  /// The patch that the last list() took as the prior mean.
  struct AtRim {
    double share = 0.0;  ///< weight of the prior mean, 0 to 1; 0: there was none
    Patch patch;
    Eigen::Matrix<double, 6, 6> covariance;  ///< PatchFit::covariance() of the patch
  };
  /// Returns the patch of the last list(); the next one overwrites it.
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

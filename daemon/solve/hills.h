// Divides the forces of an estimate into hills, each a contact.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/model.h"

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace tractiond::solve {

/// Returns the first 6 x 6 elements of a matrix of kColumns x kColumns.
WrenchCovariance firstSix(std::span<const double> covariances);

/// Sets force, moment and position of a contact, and Contact::noise.
/// \param moment about the origin,
/// \param noise of both, likewise
/// \param at the position
void setWrench(const Eigen::Vector3d& force, const Eigen::Vector3d& moment, const WrenchCovariance& noise,
               const Eigen::Vector3d& at, Contact& contact);

/// A hill is a region of the points around a local maximum of the magnitude of the forces. Hills are merged where the
/// valley between their peaks is not deep enough to be certain. Thread-bound. Allocates only when made.
class Hills {
 public:
  /// Least force of a contact, in its standard deviations.
  static constexpr double kLeast_deviations = 5.0;

  /// `atoms` must outlive it; `sensor` is used by the constructor only. The points of a body count as a grid, as its
  /// nodes are.
  Hills(const Atoms& atoms, const sensor::Sensor& sensor);

  /// Takes the forces of the points that have one and are marked in `has` (P, 0 or 1), and, where patches are not
  /// likelier than the field alone, the couples of the patches.
  /// \param mixture that the estimate is the mean of; both must outlive the calls below
  void take(const Estimate& estimate, Mixture& mixture, std::span<const unsigned char> has);

  /// Divides these forces into hills; without forces there are none.
  void divide();
  /// Makes one hill of all forces, of which there must be at least one.
  void unite();

  // Results of the last divide() or unite().

  /// Returns the number of hills, merged ones included. Their order is that of their peaks, highest first.
  int count() const { return static_cast<int>(peak_.size()); }
  /// Returns whether the hill was not merged into another one.
  bool stands(int hill) const { return parent_[hill] == hill; }
  /// Computes the forces of the points that belong to a hill, merged ones included; 0 elsewhere (3P [N]).
  void forcesOf(int hill, std::span<double> forces) const;

  /// Returns the hill as a contact, in the gel frame, without Contact::systematic; nothing if its force is below a
  /// significance() or a magnitude.
  /// \param hill below count(), one that stands()
  std::optional<Contact> describe(int hill, double least_deviations, double least_N);

  /// Returns the force of a contact in standard deviations, along the axis on which that is largest.
  static double significance(const Contact& contact);

  /// Sorts contacts by the magnitude of their forces, strongest first.
  static void sort(std::span<Contact> contacts);

 private:
  auto force(int index) const { return Eigen::Vector3d::Map(forces_.data() + 3 * index); }
  auto position(int index) const { return atoms_.points.col(places_[index]); }
  int hillOf(int index) const;
  int nearest(const PatchPlace& place) const;
  bool isFaint(int hill, const Eigen::Vector3d& whole, double least_deviations);
  void setWrenches(int hill);
  WrenchCovariance wrenchNoise(int hill);
  std::array<double, kColumns * kColumns> covariances();
  std::array<double, kColumns> leastVariances();
  double strip(int from, const Eigen::Vector2d& along, double at, const Eigen::Vector3d& direction, double factor,
               int column);
  bool isValleyBetween(int lower, int higher);
  double* functionalsOf(int point);
  void clearFunctionals();

  const Atoms& atoms_;
  const int columns_, rows_;
  sensor::Points normals_;  ///< of the points
  Eigen::VectorXd areas_;   ///< area that each point stands for [m^2]
  // Of one frame.
  Mixture* mixture_ = nullptr;
  const WrenchCovariance* whole_ = nullptr;  ///< covariance of the wrench of all that was taken; null: not known
  std::vector<int> places_;                  ///< points that have a force
  std::vector<double> forces_, magnitude_;   ///< of each
  std::span<const double> couples_;
  std::array<int, kCouples> couplesAt_{};   ///< index in places_ where each acts
  std::vector<int> indexAt_;                ///< of every point: its index in places_; -1: none
  std::vector<int> order_, hill_;           ///< of the places: strongest first; the hill each belongs to
  std::vector<int> peak_, parent_;          ///< of each hill: its highest place; itself, or the hill it was merged into
  std::vector<int> members_;                ///< of one hill
  std::vector<std::pair<int, int>> apart_;  ///< hills, the lower one first, with a valley between their peaks
  std::vector<std::pair<double, double>> valleys_;  ///< fall between two peaks, and where on the line between them
  /// Functionals of the forces of the points and of the couples, 3 (P + kCouples) x kColumns, row after row; 0 but for
  /// those in used_, which isUsed_ marks.
  LineArray<double> functionals_;
  std::vector<int> used_;
  std::vector<unsigned char> isUsed_;
};

}  // namespace tractiond::solve

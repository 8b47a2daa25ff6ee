// Divides solved forces into hills, each a contact.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/atoms.h"
#include "daemon/solve/kernels.h"
#include "sensor/gel.h"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace tractiond::solve {

/// Forces at some places of a grid and couples there, with their covariance.
class SolvedForces {
 public:
  virtual std::span<const int> places() const = 0;         ///< indices in the grid, each once
  virtual std::span<const double> forces_N() const = 0;    ///< x, y, z of each place
  virtual std::span<const int> couplesAt() const = 0;      ///< indices in places(), at most kCouples
  virtual std::span<const double> couples_Nm() const = 0;  ///< x, y, z of each couple
  /// Computes the covariance of kColumns linear functionals of forces_N() and couples_Nm(), row after row. \param
  /// functionals kColumns coefficients for each element of forces_N(), then of couples_Nm() \param of indices in
  /// places(), or in couplesAt() after them, each once: only their coefficients are read, all others count as 0
  virtual void covariances(const double* functionals, std::span<const int> of,
                           std::array<double, kColumns * kColumns>& result) const = 0;
  /// Computes lower bounds of the diagonal, in a small part of the time of covariances(). Arguments as there.
  virtual void leastVariances(const double* functionals, std::span<const int> of,
                              std::array<double, kColumns>& variances) const = 0;
  /// Returns the covariance of the wrench of all forces and couples about the origin; null: not known.
  virtual const WrenchCovariance* wrenchCovariance() const = 0;

 protected:
  ~SolvedForces() = default;
};

/// A grid of places on the surface, row after row.
struct PlaceGrid {
  int columns = 0, rows = 0;          ///< numbers of places along x and y
  sensor::Points positions, normals;  ///< [m], gel frame; unit vectors
  Eigen::VectorXd areas;              ///< area that each place stands for [m^2]
};

/// Returns the first 6 x 6 elements of a matrix of kColumns x kColumns.
WrenchCovariance firstSix(std::span<const double> covariances);

/// Sets force, moment and position of a contact, and Contact::noise. \param moment about the origin, \param noise of
/// both, likewise \param at the position
void setWrench(const Eigen::Vector3d& force, const Eigen::Vector3d& moment, const WrenchCovariance& noise,
               const Eigen::Vector3d& at, Contact& contact);

/// A hill is a region of the grid around a local maximum of the magnitude of the forces. Hills are merged where the
/// valley between their peaks is not deep enough to be certain. Thread-bound. Allocates only when made.
class Hills {
 public:
  /// Least force of a contact, in its standard deviations.
  static constexpr double kLeast_deviations = 5.0;

  /// \param mostPlaces largest number of SolvedForces::places(), with couples
  Hills(PlaceGrid grid, int mostPlaces);

  /// Divides the forces into hills; without forces there are none.
  void divide(const SolvedForces& forces);

  /// Makes one hill of all forces, of which there must be at least one.
  void unite(const SolvedForces& forces);

  // Results of the last divide() or unite().

  /// Returns the number of hills, merged ones included. Their order is that of their peaks, highest first.
  int count() const { return static_cast<int>(peak_.size()); }
  /// Returns whether the hill was not merged into another one.
  bool stands(int hill) const { return parent_[hill] == hill; }
  /// Returns the hill that a place belongs to, after merging. \param index in SolvedForces::places()
  int hillOf(int index) const;

  /// Returns the hill as a contact, in the gel frame, without Contact::systematic; nothing if its force is below a
  /// surety() or a magnitude. \param hill below count(), one that stands() \param solved at the same places as when
  /// they were divided; their values may differ
  std::optional<Contact> describe(const SolvedForces& solved, int hill, double least_deviations, double least_N);

  /// Returns the force of a contact in standard deviations, along the axis on which that is largest.
  static double surety(const Contact& contact);

  /// Sorts contacts by the magnitude of their forces, strongest first.
  static void sort(std::span<Contact> contacts);

 private:
  void measure(const SolvedForces& forces);
  bool isFaint(const SolvedForces& solved, int hill, const Eigen::Vector3d& force, double least_deviations);
  void setWrenches(const SolvedForces& solved, int hill);
  WrenchCovariance wrenchNoise(const SolvedForces& solved, int hill);
  template <typename Use>
  void around(int place, int i, Use use) const;
  double strip(const SolvedForces& forces, int from, const Eigen::Vector2d& along, double at,
               const Eigen::Vector3d& direction, double factor, int column);
  bool isValleyBetween(const SolvedForces& forces, int lower, int higher);
  double* functionalsOf(int index);
  void clearFunctionals();

  const PlaceGrid grid_;
  std::vector<int> indexAt_;                ///< of every place of the grid: its index in places(); -1: none
  std::vector<double> magnitude_;           ///< of the forces
  std::vector<int> order_, hill_;           ///< of the places: strongest first; the hill each belongs to
  std::vector<int> peak_, parent_;          ///< of each hill: its highest place; itself, or the hill it was merged into
  std::vector<int> members_;                ///< of one hill
  std::vector<std::pair<int, int>> apart_;  ///< hills, the lower one first, with a valley between their peaks
  std::vector<std::pair<double, double>> valleys_;  ///< fall between two peaks, and where on the line between them
  LineArray<double> functionals_;                   ///< of the places in used_; 0 elsewhere
  std::vector<int> used_;                           ///< indices in places()
  std::vector<unsigned char> isUsed_;               ///< of every index
};

}  // namespace tractiond::solve

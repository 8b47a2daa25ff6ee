// Divides solved forces into hills, each a contact.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/kernels.h"
#include "sensor/gel.h"

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Forces at some places of a grid, and how well they are known.
class SolvedForces {
 public:
  virtual std::span<const int> places() const = 0;       ///< indices in the grid, each once
  virtual std::span<const double> forces_N() const = 0;  ///< three of each place
  /// Covariance of kColumns functionals of the forces, stored force after force and overwritten: row after row [N^2].
  virtual void covariances(double* functionals, std::array<double, kColumns * kColumns>& result) const = 0;

 protected:
  ~SolvedForces() = default;
};

/// Places row after row.
struct PlaceGrid {
  int columns = 0, rows = 0;
  sensor::Points positions, normals;
  Eigen::VectorXd areas;  ///< that each stands for
};

/// Thread-bound. Allocates only when made.
class Hills {
 public:
  /// A contact's force exceeds so many of its standard deviations.
  static constexpr double kLeast_deviations = 5.0;

  /// `mostPlaces`: that forces are given at. `functionalRows`: numbers of a functional in SolvedForces::covariances().
  Hills(PlaceGrid grid, int mostPlaces, int functionalRows);

  /// Divides the forces.
  void divide(const SolvedForces& forces);

  /// Takes all forces for one hill.
  void unite(const SolvedForces& forces);

  // Of the last divide() or unite().
  int count() const { return static_cast<int>(peak_.size()); }   ///< highest peak first
  bool stands(int hill) const { return parent_[hill] == hill; }  ///< it is no part of another
  int hillOf(int index) const;                                   ///< of the index-th place

  /// Returns the hill as a contact, from what the forces are now.
  Contact describe(const SolvedForces& forces, int hill);

  /// Returns the force of a contact in its standard deviations, along the axis that is surest.
  static double surety(const Contact& contact);

  /// Divides the forces, of which some are evident, and lists the contacts, strongest first, at most kMaxContacts: that
  /// of the highest peak and those that are surer than kLeast_deviations. Returns their number.
  int list(const SolvedForces& forces, std::array<Contact, kMaxContacts>& contacts);

  /// Sorts contacts, strongest first.
  static void sort(std::span<Contact> contacts);

 private:
  void measure(const SolvedForces& forces);
  template <typename Use>
  void around(int place, int i, Use use) const;
  double strip(const SolvedForces& forces, int from, const Eigen::Vector2d& along, double at,
               const Eigen::Vector3d& direction, double factor, int column);
  bool apart(const SolvedForces& forces, int lower, int higher);

  const PlaceGrid grid_;
  const std::size_t functionalRows_;
  std::vector<int> indexAt_;        ///< of every place of the grid among the given ones, -1: none
  std::vector<double> magnitude_;   ///< of the forces
  std::vector<int> order_, hill_;   ///< of the places: strongest first; the hill each belongs to
  std::vector<int> peak_, parent_;  ///< of each hill: its highest place; itself, or the hill it was merged into
  std::vector<int> members_;        ///< of one hill
  LineArray<double> functionals_;
};

}  // namespace tractiond::solve

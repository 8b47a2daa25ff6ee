// The dense, slow twin of the model of contacts, straight from the formulae of docs/mathematics.md, section 4:
// every matrix whole, in double precision, without a line of what it tests. Missing coordinates are rows that were
// never there.
#pragma once

#include "daemon/solve/model_options.h"
#include "tests/unit/solve/dense_atoms.h"

#include <Eigen/Core>

#include <vector>

namespace tractiond::solve {

class DenseModel : private DenseAtoms {
 public:
  using DenseAtoms::Matrix, DenseAtoms::Vector, DenseAtoms::pointsOf;

  /// `influence`: of the points of pointsOf(), 2M x 3P; `motion`: P Q^1/2; `force_N`: the scale of tau.
  DenseModel(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence, const Matrix& motion,
             double force_N, const ModelOptions& options);

  struct Result {
    Vector forces = {};  ///< of the points
    Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    double residual = 0.0;
    Eigen::Vector4d motion = Eigen::Vector4d::Zero();  ///< in its prior's deviations, of frames without a force
    std::vector<int> atoms = {};
    int rounds = 0;
  };

  Result solve(const Vector& displacement, const std::vector<int>& present, double noise_px) const;

 private:
  struct Modes {
    Vector s;
    Matrix V;
    double noise_px;
    Matrix toAmplitudes;  ///< of displacements, by multiplication
  };
  struct Seen {
    Vector mean, known, noise;
  };
  struct Fit {
    Vector force, known, noise;
    Matrix sigma;
    double residual = 0.0;
    Eigen::Vector4d motion;
  };

  static Modes modesOf(const Matrix& H, const Matrix& motion, double noise_px);

  static std::vector<int> components(const std::vector<int>& atoms);

  std::vector<Eigen::Index> groupEnds(const Modes& modes) const;

  /// Returns the amplitudes of the modes that are read, from those of all modes.
  Vector read(const Modes& modes, const Vector& all, double least) const;

  /// Returns the number of modes in the groups in which forces of the size `tau` are visible.
  Eigen::Index visible(const Modes& modes, double tau) const;

  double likeliest(const Modes& modes, const Vector& c, double least) const;

  struct Surest {
    double squaredDeviations = 0.0;
    Eigen::Index atom = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
  };

  /// Fits the force of each atom alone to the modes of the first group. Returns that of the atom that explains most.
  Surest surest(const Modes& modes, const Vector& c) const;

  /// `c`: of the first modes.
  Seen start(const Modes& modes, const Vector& c, const Surest& surest) const;

  /// Returns the tau of an even picture with the squared force of `surest`.
  double leastTau(const Surest& surest) const;

  Vector evident(const Seen& seen) const;

  Vector coupled(const Vector& of) const;

  Eigen::Matrix3d directions(const Seen& seen, const Vector& evidence, int atom, bool wide) const;

  static Vector sizes(const Vector& squares);

  static std::vector<int> falling(const Vector& value);

  /// Returns the selected atoms. Reduces their gamma by the value of the next atom.
  std::vector<int> select(Vector& gamma, const Vector& squares, int most, double n2) const;

  /// \param continues whether the contact may continue around what was found
  void roughen(std::vector<int>& atoms, Vector& gamma, const Vector& mean, const Vector& squares, int most, double n2,
               bool continues) const;

  /// Returns q^2 / 3 of all atoms under forces of the points; the points beyond the nodes have at least the pressure of
  /// the nearest node. \param around distance over which the pressure is averaged more [m]
  Vector beneath(const Vector& forces, double around = 0.0) const;

  Vector reciprocalPressure(const Vector& forces, double reach) const;

  static Fit posterior(const Matrix& H, const Matrix& motion, const Vector& d, double n2, const std::vector<int>& atoms,
                       const Vector& gamma, const std::vector<Eigen::Matrix3d>& omega);

  static void keep(const Fit& fit, const std::vector<int>& atoms, Seen& seen);

  /// Returns the wrenches of unit forces at the points, 6 x 3P.
  Matrix wrenches() const;

  ModelOptions options_;
  double depth_m_, force_N_;
  Matrix motion_;
  Matrix H_;
};

}  // namespace tractiond::solve

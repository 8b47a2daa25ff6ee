// Factors the influence of a sensor's atoms on its markers, once for all frames.
//
//   d = H f + P m + noise    the displacements: forces f of the atoms, and motion m ~ N(0, Q) of the whole picture
//   W = (1 + P Q P' / n^2)^-1    the weight of the displacements, whose noise is n [px]
//   W^1/2 H = U S V'         the weighted influence, with its r largest singular values s [px/N]
#pragma once

#include "base/error.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/atoms.h"
#include "daemon/solve/kernels.h"
#include "daemon/solve/model_constants.h"
#include "daemon/solve/options.h"

#include <tl/expected.hpp>

#include <array>
#include <functional>
#include <vector>

namespace tractiond::solve {

/// How the whole picture may move.
struct MotionPrior {
  Eigen::MatrixXd modes;      ///< P, 2M x 4: displacements by a unit of each motion [px/px, px/px, px, px/rad]
  Eigen::Vector4d variances;  ///< diagonal of Q [px^2, px^2, 1, rad^2]; 0: that motion does not happen
};

/// A matrix over the three components of one force, or of two forces.
using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Errors of the computed wrench (force and moment) of a load by one standard deviation of each quantity that is not
/// known exactly: 6 x 6 matrices, row after row, for the camera's position x, y, z, rotation x, y, z and focal length,
/// and for a block's Poisson's ratio, thickness and depth of each layer.
struct SystematicErrors {
  std::vector<double> contact;    ///< of a small contact (contactReadings())
  std::vector<double> wholeFace;  ///< of a load on the whole face (wholeFaceReading())

  /// Errors by depths that scatter from marker to marker (Uncertainty::markerDepth; empty where that is 0): 6 x 3
  /// matrices E, row after row. A force F has an error of force and moment about its place with the covariance
  /// sum E F F' E'.
  std::vector<double> contactScatter, wholeFaceScatter;

  /// Covariances of the wrench of a small contact about its place, and of one on the whole face about the origin, by
  /// 1 K since the zero, 6 x 6, row after row [N^2/K^2 ..].
  std::array<double, 36> contactHeat{}, wholeFaceHeat{};

  /// Error of the displacements around a contact by a block's Poisson's ratio, thickness and depths, relative to these,
  /// rms. That by Uncertainty::model is not part of it.
  double displacement = 0.0;
};

/// Of 2M coordinates, P points, A atoms, r modes. Immutable once made; any thread may read it.
struct Factors {
  Id id{};                             ///< of all that they depend on: the calibration published with a field
  std::int64_t computed_ns = 0;        ///< CLOCK_REALTIME when they were computed
  double force_N = 0.0;                ///< Young's modulus times a pitch squared, the scale of forces
  std::vector<double> singularValues;  ///< r, falling [px/N]
  RowMatrix left;                      ///< [R, W^1/2 U], 2M x (4 + r): a picture's amplitudes are left' d [px]
  Eigen::Vector4d motionGain;          ///< D: W = 1 - R D R'
  RowMatrix right;           ///< V of the points, 3P x r; that of an atom is the mean of its points', by their shares
  RowMatrix influence;       ///< H', 3A x 2M [px/N]
  std::vector<double> gram;  ///< H'H [px^2/N^2], the lower triangle of its Blocks row after row
  RowMatrix motion;          ///< (P Q^1/2)', 4 x 2M [px]
  Eigen::Matrix<double, kMotions, Eigen::Dynamic> motionCoupling;  ///< (P Q^1/2)' H, 4 x 3A [px^2/N]
  Eigen::Matrix4d motionGram;                                      ///< (P Q^1/2)' P Q^1/2 [px^2]
  SystematicErrors systematicErrors;

  int coordinateCount() const { return left.rows(); }     ///< Returns 2M.
  int rank() const { return right.columns(); }            ///< Returns r.
  int pointCount() const { return right.rows() / 3; }     ///< Returns P.
  int atomCount() const { return influence.rows() / 3; }  ///< Returns A.

  /// Returns H'H of two atoms, a >= b [px^2/N^2].
  Eigen::Map<const Block> gramOf(int a, int b) const {
    const auto row = static_cast<std::size_t>(a), column = static_cast<std::size_t>(b);
    return Eigen::Map<const Block>(gram.data() + 9 * (row * (row + 1) / 2 + column));
  }
};

/// Computes the factors in seconds, on all cores and with about twice the memory of the factors. Leaves
/// `id`, `computed_ns` and `systematicErrors` to the caller, but takes the latter two over from `near`. Fails if the
/// matrix is not finite or all zero, or if all singular values are below SolveOptions::faintest (EX_CONFIG), or if its
/// eigenvectors are not found (EX_SOFTWARE). force_N and SolveOptions::noise_px must be above 0, and the sizes must fit
/// (asserted). The arguments need not outlive the result.
/// \param influence of the points, 2M x 3P [px/N]; freed as soon as it is no longer needed
/// \param force_N as in Factors
/// \param near factors of nearly the same influence: the modes are then combinations of its modes, which takes a third
/// of the time; null: none
/// \param decomposing called before the modes are computed, which takes most of the time; may be empty
tl::expected<Factors, Error> computeFactors(Eigen::MatrixXd influence, const Atoms& atoms, const MotionPrior& motion,
                                            double force_N, const SolveOptions& options, const Factors* near = nullptr,
                                            const std::function<void()>& decomposing = {});

/// Steps that a new gel takes, in their order.
enum class Step { kInfluence, kProducts, kModes, kSystematicErrors, kDetectionLimit };
/// Called on the computing thread when a step begins, and while it lasts where its share is known.
/// \param done of the step, from 0 to 1
using Steps = std::function<void(Step step, double done)>;

/// Computes the influence of the points by the sensor's mechanics, and the factors as above, with the same errors.
/// \param steps called for kInfluence to kModes
tl::expected<Factors, Error> computeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                            const SolveOptions& options, const Steps& steps = {});

/// Computes the rows of V of an atom, 3 x r: the mean of those of its points, by their shares.
/// \param rows must have that size; it is not resized
void modesOfAtom(const Factors& factors, const Atoms& atoms, int atom, Eigen::MatrixXd& rows);

/// Returns P and Q of a sensor's pictures.
MotionPrior motionPrior(const sensor::Sensor& sensor);

}  // namespace tractiond::solve

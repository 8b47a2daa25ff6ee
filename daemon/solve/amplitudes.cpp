#include "daemon/solve/amplitudes.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace tractiond::solve {
namespace {

/// Steps after which what is still left does not matter, and the share of the right-hand side that ends them.
constexpr int kSteps = 20;
constexpr double kPrecise = 1e-4;

}  // namespace

Amplitudes::Amplitudes(const Factors& factors, std::shared_ptr<const StrongModes> strong)
    : factors_(factors)
    , strong_(std::move(strong))
    , there_(factors.left.stride())
    , all_(there_.size())
    , filtered_(there_.size())
    , gain_(there_.size(), 0.0)
    , everyCoordinate_(every(factors.coordinateCount()))
    , coefficients_(everyCoordinate_.size())
    , completed_(everyCoordinate_.size())
    , residual_(everyCoordinate_.size())
    , direction_(everyCoordinate_.size())
    , image_(everyCoordinate_.size()) {}

std::span<const double> Amplitudes::values() const {
  return {all_.data() + kMotions, static_cast<std::size_t>(std::max(columns_ - kMotions, 0))};
}

void Amplitudes::begin(std::span<const float> displacement_px, std::span<const int> missing) {
  assert(displacement_px.size() == everyCoordinate_.size());
  displacement_ = displacement_px;
  missing_ = missing;
  columns_ = 0;
  std::fill_n(there_.data(), there_.size(), 0.0);
}

/// The modes' left vectors, with those at least that are read.
const RowMatrix& Amplitudes::left() const {
  return columns_ <= strong_->left.columns() ? strong_->left : factors_.left;
}

void Amplitudes::read(int modes) {
  const int first = padded(columns_);  // what fills a line was read with it
  columns_ = kMotions + modes;
  if (first < columns_) addColumns(left(), everyCoordinate_, displacement_, first, columns_, there_.data());
  std::copy_n(there_.data(), there_.size(), all_.data());
  std::fill(completed_.begin(), completed_.end(), 0.0);
}

/// Displacements at the missing coordinates.
void Amplitudes::fit(const double* amplitudes, std::vector<double>& displacement) {
  for (int k = 0; k < columns_; ++k) filtered_.data()[k] = static_cast<float>(gain_[k] * amplitudes[k]);
  std::fill_n(filtered_.data() + columns_, padded(columns_) - columns_, 0.0F);
  multiplyFirst(left(), missing_, columns_, filtered_.data(), displacement.data());
}

/// Adds the amplitudes of displacements at the missing coordinates.
void Amplitudes::project(std::span<const double> displacement, double* amplitudes) {
  for (std::size_t i = 0; i < missing_.size(); ++i) coefficients_[i] = static_cast<float>(displacement[i]);
  addColumns(left(), missing_, {coefficients_.data(), missing_.size()}, 0, columns_, amplitudes);
}

void Amplitudes::complete(double force_N, double noise_px) {
  std::copy_n(factors_.motionGain.data(), kMotions, gain_.begin());
  for (int k = kMotions; k < columns_; ++k) {
    const double signal = square(factors_.singularValues[k - kMotions] * force_N);
    gain_[k] = signal / (signal + square(noise_px));
  }

  // (1 - K_mm) d_m = K_mv d_v, whose residual is K d - d at the missing coordinates.
  const auto count = static_cast<int>(missing_.size());
  fit(there_.data(), residual_);
  const double enough = square(kPrecise) * dotProduct(residual_.data(), residual_.data(), count);
  fit(all_.data(), residual_);
  for (int i = 0; i < count; ++i) residual_[i] -= completed_[i];
  std::copy_n(residual_.begin(), count, direction_.begin());
  double squares = dotProduct(residual_.data(), residual_.data(), count);
  for (int step = 0; step < kSteps && squares > enough; ++step) {
    std::fill_n(all_.data(), all_.size(), 0.0);
    project(direction_, all_.data());
    fit(all_.data(), image_);
    for (int i = 0; i < count; ++i) image_[i] = direction_[i] - image_[i];
    const double length = squares / dotProduct(direction_.data(), image_.data(), count);
    for (int i = 0; i < count; ++i) completed_[i] += length * direction_[i];
    for (int i = 0; i < count; ++i) residual_[i] -= length * image_[i];
    const double before = squares;
    squares = dotProduct(residual_.data(), residual_.data(), count);
    for (int i = 0; i < count; ++i) direction_[i] = residual_[i] + squares / before * direction_[i];
  }
  std::copy_n(there_.data(), there_.size(), all_.data());
  project(completed_, all_.data());
}

}  // namespace tractiond::solve

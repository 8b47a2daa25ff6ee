#include "daemon/solve/modes.h"

namespace tractiond::solve {
namespace {

/// Times that missing displacements are completed: the first time the missing ones themselves pass for forces.
constexpr int kCompletions = 2;

}  // namespace

Modes::Modes(const Factors& factors, const Atoms& atoms, const ModelOptions& options)
    : factors_(factors)
    , detection_(detectionThreshold(options.falseAlarms, atoms.count()))
    , strong_(std::make_shared<const StrongModes>(factors, atoms, options))
    , amplitudes_(factors, strong_)
    , evidence_(factors, atoms, options, strong_) {}

Modes::Modes(const Modes& other)
    : factors_(other.factors_)
    , detection_(other.detection_)
    , strong_(other.strong_)
    , amplitudes_(other.factors_, strong_)
    , evidence_(other.evidence_) {}

const SurestForce& Modes::look(const Displacements& picture, std::span<const float> displacement_px) {
  noise_px_ = picture.noise_px;
  isMissing_ = !picture.missing.empty();
  amplitudes_.begin(displacement_px, picture.missing);
  readMore(0.0);
  complete();
  return surest_ = evidence_.surest(amplitudes_.values(), noise_px_);
}

bool Modes::detect(const Displacements& picture, std::span<const float> displacement_px,
                   std::span<const float> variance_px2) {
  surest_ = evidence_.confirmed(look(picture, displacement_px), noise_px_, detection_, variance_px2);
  return surest_.squaredDeviations >= square(detection_);
}

void Modes::start(AtomMoments& moments) {
  const double least_N = evidence_.leastTypical_N(surest_);
  while (readMore(least_N)) {
    while (readMore(least_N)) {
    }
    complete();
  }
  evidence_.start(amplitudes_.values(), noise_px_, surest_, moments);
}

/// Reads the next modes if they are needed. Returns whether they are.
bool Modes::readMore(double least_N) {
  const int modes = evidence_.modesToRead(amplitudes_.values(), noise_px_, least_N);
  if (modes == std::ssize(amplitudes_.values())) return false;
  amplitudes_.read(modes);
  return true;
}

/// Completes what is missing.
void Modes::complete() {
  for (int i = 0; i < kCompletions && isMissing_; ++i) {
    amplitudes_.complete(evidence_.typicalForce_N(amplitudes_.values(), noise_px_), noise_px_);
  }
}

}  // namespace tractiond::solve

// Makes symbols of what one contact does between its begin and its end.
#pragma once

#include "client/input/strokes/alphabet.h"
#include "client/input/strokes/recogniser.h"

#include <map>
#include <optional>
#include <string>

namespace traction::input {

/// What was written.
struct Reading {
  enum class Kind {
    kSymbol,    ///< `symbol`
    kMode,      ///< from now on the strokes of the mode `symbol`
    kTap,       ///< the contact moved too little for a stroke
    kDoubtful,  ///< `symbol` is the likeliest, but another one nearly as likely, or none is like it: nothing is written
  };
  Kind kind = Kind::kTap;
  std::string symbol;
  double margin = 0.0;    ///< Recogniser::Best
  double distance = 0.0;  ///< the same
};

/// Returns the larger side of the box around a stroke, which has a point at least.
double extent(const Stroke& stroke);

/// Reads strokes in the modes of an alphabet, each also leaning to either side, wider and narrower. Thread-bound.
class StrokeReader {
 public:
  struct Options {
    /// Smallest extent of a stroke, in the unit of the points: 3 mm for places; for shear, some 0.3 N.
    double leastExtent = 3.0;
    double leastMargin = 0.03;    ///< below it a stroke is doubtful
    double mostDistance = 1.2e4;  ///< above it as well: 5 cells off in each point, of the 32 of a stroke's size
  };

  explicit StrokeReader(const Alphabet& alphabet)
      : StrokeReader(alphabet, Options{}) {}
  StrokeReader(const Alphabet& alphabet, const Options& options);

  /// Takes where the contact is now, or its shear: x to the right, y up. The first one begins a stroke.
  void move(const std::array<double, 2>& to) { stroke_.push_back(to); }
  /// Ends the stroke and returns what it was. Returns nothing if none has begun.
  std::optional<Reading> end();
  /// Forgets the stroke: the contact was lost, or is no stroke.
  void cancel() { stroke_.clear(); }

 private:
  Options options_;
  std::map<std::string, Recogniser, std::less<>> modes_;
  std::string mode_{kLetters};
  Stroke stroke_;
};

}  // namespace traction::input

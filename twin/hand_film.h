// Draws what the cameras of the hand's two fingers see.
#pragma once

#include "twin/film.h"

namespace twin {

/// A hand and the film of each of its fingers. Thread-bound.
class HandFilm {
 public:
  /// Copies the scenario, which must have a hand. For `seed`, `cache` and `progress` see GelFilm.
  HandFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache,
           const sensor::elastic::Progress& progress = {});

  Hand& hand() { return hand_; }

  /// Draws what a finger's camera sees now, and overwrites `truth`. As Film::draw(), but for the contacts.
  void draw(int finger, Picture& picture, Truth& truth);

 private:
  Hand hand_;
  std::vector<GelFilm> films_;  ///< one a finger, with the same mechanics
};

}  // namespace twin

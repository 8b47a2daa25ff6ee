// What the twin's camera sees, frame by frame.
#pragma once

#include "twin/failure.h"
#include "twin/gel_model.h"
#include "twin/gv_camera.h"
#include "twin/renderer.h"

#include <map>
#include <memory>

namespace twin {

/// What is true in one frame.
struct Truth {
  struct Load {
    const Contact* contact = nullptr;
    ContactState state;
  };
  double time_s = 0.0;               ///< of the scenario, since the first frame
  std::optional<std::size_t> image;  ///< for given pictures: which one; then nothing else is known
  Resultant resultant;
  std::vector<Load> contacts;        ///< those that carry a load
  std::vector<int> missing;          ///< markers that are not drawn
  double rise_K = 0.0;               ///< of the temperature
  bool torn = false;                 ///< part of the picture is not of this moment, or not in its place
  Eigen::Matrix2Xd displacement_px;  ///< of all markers, drawn or not
};

/// Thread-bound.
class Film {
 public:
  virtual ~Film() = default;

  /// Draws into picture.pixels what happens at picture.time_s, in picture.format; picture.number is the noise's seed.
  virtual void draw(Picture& picture, Truth& truth) = 0;
};

/// A scenario, with the gel's mechanics.
class GelFilm : public Film {
 public:
  /// See GelModel for `cache` and `progress`. `seed` is mixed into the noise.
  GelFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache,
          const sensor::elastic::Progress& progress = {});

  void draw(Picture& picture, Truth& truth) override;

 private:
  /// The pixels of all markers at a moment of the period.
  const Eigen::Matrix2Xd& markersAt(double phase_s);

  Scenario scenario_;
  std::uint32_t seed_;
  GelModel model_;
  sensor::Projection project_;
  sensor::Points rest_;
  Eigen::Matrix2Xd rest_px_, markers_px_, drawn_px_;
  std::vector<ContactState> states_;
  Creep creep_;
  double rise_K_ = 0.0;                                      ///< in markers_px_
  std::vector<std::uint8_t> older_;                          ///< a whole picture of which part is shown
  std::map<std::pair<Format, double>, Renderer> renderers_;  ///< by format and blur
};

/// Raw pictures from a file, one after another, again and again: pictures of the scenario's size and format.
class RawFilm : public Film {
 public:
  static tl::expected<std::unique_ptr<RawFilm>, Failure> open(const std::filesystem::path& file,
                                                              std::size_t pictureSize);

  /// A client that chooses another format gets the same bytes, cut or filled up with zeros.
  void draw(Picture& picture, Truth& truth) override;

 private:
  std::vector<std::uint8_t> pixels_;
  std::size_t pictureSize_ = 0;
};

}  // namespace twin

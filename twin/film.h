// Draws the pictures of the twin's camera frame by frame.
#pragma once

#include "base/error.h"
#include "twin/body_model.h"
#include "twin/creep.h"
#include "twin/gel_model.h"
#include "twin/gv_camera.h"
#include "twin/renderer.h"

#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace twin {

/// The true state in one frame.
struct Truth {
  struct Load {
    Contact::Shape shape = Contact::Shape::kHertz;
    double radius = 0.0;               ///< [m]
    ContactState state;                ///< of a body: its force is in the gel frame
    std::optional<double> stickRatio;  ///< of an object in the hand
    struct OnBody {
      Eigen::Vector3d place, normal;  ///< of the patch's centre, as of BodyLoad
    };
    std::optional<OnBody> onBody;
  };
  double time_s = 0.0;               ///< scenario time since the first frame
  std::optional<std::size_t> image;  ///< number of a given picture; nothing else is then known
  Resultant resultant;               ///< of all contacts on the gel
  std::vector<Load> contacts;        ///< contacts that carry a load
  std::vector<int> missing;          ///< indices of markers that are not drawn, in no order; one may occur twice
  double rise_K = 0.0;               ///< temperature above that of the first zero
  Eigen::Matrix2Xd displacement_px;  ///< of all markers, drawn or not; 2 x markers, (u, v)
  std::optional<int> finger;         ///< of a hand: 0 or 1; `hand` is then set
  Hand::State hand;
};

/// A source of pictures. Thread-bound.
class Film {
 public:
  virtual ~Film() = default;

  /// Draws the scene at picture.time_s into picture.pixels, in picture.format, and overwrites `truth` with the true
  /// state. picture.number selects the noise. Cannot fail.
  virtual void draw(Picture& picture, Truth& truth) = 0;
};

/// Draws a scenario with the gel's mechanics.
class GelFilm : public Film {
 public:
  /// Copies the scenario. Takes seconds; for `cache` see GelModel.
  /// \param seed changes the noise
  GelFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache);

  /// Implements Film::draw. Resizes picture.pixels. The scenario repeats after Scenario::period_s; creep and the drift
  /// of the light go on, so picture.time_s must not fall.
  void draw(Picture& picture, Truth& truth) override;

  /// Replaces the states of all contacts, at all times.
  void hold(std::vector<ContactState> states) { held_ = std::move(states); }
  void reseed(std::uint32_t seed) { seed_ = seed; }

 private:
  /// Returns the displacements of all markers, 3 x markers [m].
  sensor::Points displacement(std::span<const ContactState> states);
  /// Writes the contacts and their resultant.
  void tell(std::span<const ContactState> states, Truth& truth) const;
  /// Sets markers_px_.
  void moveMarkers(const std::vector<ContactState>& states, double rise_K);

  Scenario scenario_;
  std::uint32_t seed_;
  std::optional<BodyModel> body_;  ///< in place of model_
  GelModel model_;
  sensor::Projection project_;
  sensor::Points rest_;
  Eigen::Matrix2Xd rest_px_, markers_px_, drawn_px_;
  std::vector<ContactState> held_;    ///< in place of those of the scenario, unless empty
  std::vector<ContactState> states_;  ///< of markers_px_
  Creep creep_;
  double rise_K_ = 0.0;  ///< temperature of markers_px_
  std::map<Format, Renderer> renderers_;
};

/// A hand, and what the camera of each of its fingers sees. Thread-bound.
class HandFilm {
 public:
  /// Copies the scenario, which must have a hand. For `seed` and `cache` see GelFilm.
  HandFilm(const Scenario& scenario, std::uint32_t seed, const std::filesystem::path& cache);

  Hand& hand() { return hand_; }

  /// Draws what a finger's camera sees now, and overwrites `truth`. As Film::draw(), but for the contacts.
  void draw(int finger, Picture& picture, Truth& truth);

 private:
  Hand hand_;
  std::vector<GelFilm> films_;  ///< one a finger, with the same mechanics
};

/// Serves raw pictures from a file in a loop. They have the scenario's size and format.
class RawFilm : public Film {
 public:
  /// Reads the whole file into memory. Errors: EX_NOINPUT if it cannot be read, EX_DATAERR if it is empty or its size
  /// is not a multiple of `pictureSize` [bytes].
  static tl::expected<std::unique_ptr<RawFilm>, tractiond::Error> open(const std::filesystem::path& file, Format format,
                                                                       std::size_t pictureSize);

  /// Copies the bytes of picture number picture.number modulo the number of pictures into picture.pixels, which is
  /// resized to `pictureSize` of open(). In another format than that of open(), sets the pixels to zero and keeps their
  /// size. Noise and the scenario's contacts do not apply.
  void draw(Picture& picture, Truth& truth) override;

 private:
  Format format_ = Format::kRgb8;
  std::vector<char> pixels_;
  std::size_t pictureSize_ = 0;
};

}  // namespace twin

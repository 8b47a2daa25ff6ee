// Writes a picture of the camera as a PNG file, with rings around markers and spots.
#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/show/output.h"
#include "client/show/png_file.h"
#include "traction/control.h"

#include <sysexits.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace traction::client {

namespace {

constexpr float kRadius_px = 5.0F;   // of a cross, half the side of a square, and the least radius of a ring
constexpr float kRingShare = 0.36F;  // of the distance between markers, whose discs are smaller than 0.29 of it

struct Ink {
  std::uint8_t red, green, blue;
};

/// Colours of the rings, which differ from those of the markers.
constexpr Ink kOutline = {0, 0, 0};
constexpr Ink kBlue = {90, 220, 255}, kRed = {255, 190, 60}, kLost = {255, 40, 255}, kExpected = {240, 240, 240};

Ink inkOf(Colour colour) {
  return colour == Colour::kRed ? kRed : kBlue;
}

/// An RGB picture to draw on. Places are pixels of the camera.
class Drawing {
 public:
  explicit Drawing(const Snapshot& snapshot)
      : width_(static_cast<int>(snapshot.width))
      , height_(static_cast<int>(snapshot.height))
      , perPixel_(1.0F / static_cast<float>(snapshot.reduced))
      , levels_(3 * static_cast<std::size_t>(snapshot.width) * snapshot.height) {
    const std::size_t pixels = levels_.size() / 3;
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        levels_[3 * i + c] = snapshot.levels[snapshot.channels == 1 ? i : 3 * i + c];
      }
    }
  }

  /// Draws a ring between two black ones, so that it is visible on any picture.
  void ring(std::array<float, 2> place, float radius_px, Ink ink) {
    const float pixel = 1.0F / perPixel_;
    circle(place, radius_px - pixel, kOutline);
    circle(place, radius_px + pixel, kOutline);
    circle(place, radius_px, ink);
  }

  void cross(std::array<float, 2> place, Ink ink) {
    for (float t = -kRadius_px; t <= kRadius_px; t += 0.5F) {
      dot(place, t, t, ink);
      dot(place, t, -t, ink);
    }
  }

  void square(std::array<float, 2> place, Ink ink) {
    for (float t = -kRadius_px; t <= kRadius_px; t += 0.5F) {
      for (const float side : {-kRadius_px, kRadius_px}) {
        dot(place, t, side, ink);
        dot(place, side, t, ink);
      }
    }
  }

  void point(std::array<float, 2> place, Ink ink) {
    for (const float du : {-0.5F, 0.5F}) {
      for (const float dv : {-0.5F, 0.5F}) dot(place, du, dv, ink);
    }
  }

  const std::vector<std::uint8_t>& levels() const { return levels_; }

 private:
  void circle(std::array<float, 2> place, float radius_px, Ink ink) {
    const int steps = std::max(16, static_cast<int>(10.0F * radius_px * perPixel_));
    for (int i = 0; i < steps; ++i) {
      const float angle = 6.2831853F * static_cast<float>(i) / static_cast<float>(steps);
      dot(place, radius_px * std::cos(angle), radius_px * std::sin(angle), ink);
    }
  }

  void dot(std::array<float, 2> place, float du, float dv, Ink ink) {
    const auto pixel = [this](float at, float by) {
      return static_cast<int>(std::lround(std::clamp(perPixel_ * (at + by), -1e6F, 1e6F)));
    };
    const int x = pixel(place[0], du), y = pixel(place[1], dv);
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    std::uint8_t* const to = levels_.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                                   static_cast<std::size_t>(x));
    to[0] = ink.red;
    to[1] = ink.green;
    to[2] = ink.blue;
  }

  int width_, height_;
  float perPixel_;
  std::vector<std::uint8_t> levels_;
};

/// Returns the radius of a ring that lies outside the discs of markers: by the median distance to the nearest one of
/// the same colour.
float ringRadius_px(const Snapshot& snapshot) {
  std::vector<float> nearest;
  for (const Snapshot::Marker& marker : snapshot.markers) {
    float least = 1e9F;
    for (const Snapshot::Marker& other : snapshot.markers) {
      if (&other == &marker || other.colour != marker.colour) continue;
      least =
          std::min(least, std::hypot(other.place_px[0] - marker.place_px[0], other.place_px[1] - marker.place_px[1]));
    }
    nearest.push_back(least);
  }
  if (nearest.size() < 2) return kRadius_px;
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  return std::max(kRadius_px, kRingShare * std::min(*middle, 1e3F));
}

void mark(Drawing& drawing, const Snapshot& snapshot) {
  const float ring_px = ringRadius_px(snapshot);
  using State = Snapshot::MarkerState;
  const bool known = std::any_of(snapshot.markers.begin(), snapshot.markers.end(),
                                 [](const auto& marker) { return marker.state != State::kSought; });
  if (!known) {
    for (const Snapshot::Spot& spot : snapshot.spots) drawing.square(spot.place_px, inkOf(spot.colour));
  }
  for (const Snapshot::Marker& marker : snapshot.markers) {
    switch (marker.state) {
    case State::kFound:
      drawing.ring(marker.place_px, ring_px, inkOf(marker.colour));
      break;
    case State::kLost:
      drawing.cross(marker.place_px, kLost);
      break;
    case State::kSought:
    case State::kAbsent:
      drawing.point(marker.place_px, kExpected);
      break;
    }
  }
}

/// Returns a note on the scale; empty: the picture has the camera's own pixels.
std::string reducedInWords(const Snapshot& snapshot) {
  if (snapshot.reduced == 1) return "";
  return " (" + std::to_string(snapshot.reduced) +
         " times smaller than the camera's picture: no use for traction-lens)";
}

/// Writes the camera's next picture as a PNG file, which is replaced if it exists, and prints one line about it.
/// \param marked true: draws the markers on it, or the spots found if no markers are labelled yet
/// \throws OutputError also if the file cannot be written
void snapshot(const ControlOptions& options, const std::string& path, bool marked) {
  const Snapshot snapshot = Control(options).snapshot();
  Drawing drawing(snapshot);
  if (marked) mark(drawing, snapshot);
  const bool grey = snapshot.channels == 1 && !marked;

  writePng(path, snapshot.width, snapshot.height, grey ? 1 : 3, grey ? snapshot.levels.data() : drawing.levels().data(),
           snapshot.measuredWith);
  const auto count = [&](Snapshot::MarkerState state) {
    return std::count_if(snapshot.markers.begin(), snapshot.markers.end(),
                         [state](const auto& marker) { return marker.state == state; });
  };
  const std::string what = path + ": " + std::to_string(snapshot.width) + " x " + std::to_string(snapshot.height) +
                           " pixels of " + printable(snapshot.pixelFormat) + ", frame " +
                           std::to_string(snapshot.frameNumber) + reducedInWords(snapshot);
  if (snapshot.markers.empty()) {
    std::printf("%s; %s\n", what.c_str(),
                marked ? "no gel: there is nothing to mark" : "no gel: no markers are sought");
    return flushOutput();
  }
  std::printf("%s; of %zu markers %zd found, %zd lost, %zd not in the zero\n", what.c_str(), snapshot.markers.size(),
              static_cast<std::ptrdiff_t>(count(Snapshot::MarkerState::kFound)),
              static_cast<std::ptrdiff_t>(count(Snapshot::MarkerState::kLost)),
              static_cast<std::ptrdiff_t>(count(Snapshot::MarkerState::kAbsent)));
  flushOutput();
}

}  // namespace

void addSnapshot(Commands& commands) {
  struct Options {
    std::string path;
    bool marked = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& command =
      commands.add("snapshot", "Writes the camera's next picture as a PNG file", [options](const Target& target) {
        return snapshot(target.control(), options->path, options->marked), EX_OK;
      });
  command.add_option("file", options->path, "file to write; an existing one is replaced")
      ->type_name("FILE")
      ->required();
  command.add_flag("--marked", options->marked,
                   "draws rings in their colour around the markers found, crosses where they are lost, small dots "
                   "where the gel file has them, and squares around other spots that look like markers");
}

}  // namespace traction::client

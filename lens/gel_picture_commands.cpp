// The commands that use one picture of a mounted gel: pose and mark.
#include "daemon/calibrate/gel_check.h"
#include "daemon/calibrate/picture_look.h"
#include "daemon/track/nominal.h"
#include "lens/commands.h"
#include "lens/first_pose.h"
#include "lens/picture_file.h"
#include "lens/rest_markers.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace lens {

namespace {

using tractiond::calibrate::Geometry;

constexpr double kMillimetres = 1e3;
constexpr double kStatedPlaces = 1.5;  // times the stated deviation of the markers' places: as the daemon accepts

/// A picture, the sensor that it should show, and the markers found.
struct Seen {
  cv::Mat picture;
  sensor::Sensor sensor;
  RestMarkers markers;
};

/// Binds the sensor to the picture's camera. Fails if its lens was measured with another one, or in another cut.
Done bind(sensor::Sensor& sensor, const PoseOptions& options, Report& report) {
  // Calibrated files of before state the camera alone.
  if (sensor.measuredWith.empty() && sensor.calibration) sensor.measuredWith = sensor.calibration->camera;
  const auto lens = sensor::MeasuredWith::parse(sensor.measuredWith), with = measuredWith(options.picture);
  sensor::Uncertainty& known = sensor.uncertainty;
  const sensor::Uncertainty usual;  // of a lens that was not measured
  if (with.camera.empty()) {
    report.note("%s does not say which camera took it, as tractionctl snapshot does: its size alone was compared",
                options.picture.c_str());
    return {};
  }
  sensor.measuredWith = with.text();
  if (lens.camera.empty() && known.principal_px != usual.principal_px) {
    report.note("%s does not say which camera's lens it has: it is taken for that of %s", options.gel.c_str(),
                with.camera.c_str());
  }
  if (lens.holdsFor(with)) return {};
  if (!options.sameLens || (!lens.picture.empty() && lens.picture != with.picture)) {
    return tl::unexpected(Faults{fault(
        options.picture, "is of " + with.text() + ", the lens of " + options.gel + " was measured with " + lens.text(),
        "use that camera with that picture; or measure the lens in this one (traction-lens calibrate); or add "
        "--same-lens if the same lens is now on another camera of that model")});
  }
  known.principal_px = std::max(known.principal_px, usual.principal_px);  // chips do not lie alike in their housings
  known.focal = std::max(known.focal, usual.focal);
  report.note("the lens was measured with %s: on %s it is taken as known to %.1f %% and %.0f px", lens.camera.c_str(),
              with.camera.c_str(), 100.0 * known.focal, known.principal_px);
  return {};
}

/// \param posing nullptr: nothing is measured
tl::expected<Seen, Faults> loadAndFindMarkers(const PictureOptions& options, Report& report,
                                              const PoseOptions* posing = nullptr) {
  auto sensor = loadGel(options.gel);
  if (!sensor) return tl::unexpected(sensor.error());
  auto picture = readPicture(options.picture, {sensor->camera.width, sensor->camera.height});
  if (!picture) return tl::unexpected(Faults{picture.error()});
  if (const Done bound = posing == nullptr ? Done() : bind(*sensor, *posing, report); !bound)
    return tl::unexpected(bound.error());
  auto markers = findMarkers(*picture, *sensor);
  if (!markers) {
    return tl::unexpected(Faults{fault(options.picture, markers.error().what, markers.error().remedy)});
  }
  *markers = counted(*sensor, *std::move(markers));
  report.item("%d of %d markers found", markers->count(), sensor->markerCount());
  return Seen{*std::move(picture), *std::move(sensor), *std::move(markers)};
}

void describe(const Geometry& found, Report& report) {
  const sensor::Camera& camera = found.camera;
  const sensor::Uncertainty& known = found.uncertainty;
  report.line("The camera, with standard deviations:");
  const char* positions[] = {"position_x_mm", "position_y_mm", "position_z_mm"};
  const char* rotations[] = {"rotation_x_rad", "rotation_y_rad", "rotation_z_rad"};
  for (int i = 0; i < 3; ++i) {
    report.figure(positions[i], kMillimetres * camera.position[i], kMillimetres * known.position[i], "mm");
  }
  for (int i = 0; i < 3; ++i) report.figure(rotations[i], camera.rotation[i], known.rotation[i], "rad");
  report.figure("focal_px", camera.focal_px, camera.focal_px * known.focal, "px");
  if (camera.aspect != 1.0) report.figure("aspect", camera.aspect, -1.0, "");
  report.figure("principal_u_px", camera.principal_px.x(), found.principalDeviation_px, "px");
  report.figure("principal_v_px", camera.principal_px.y(), found.principalDeviation_px, "px");
  report.figure("k1", camera.k1, found.k1Deviation, "");
  report.figure("k2", camera.k2, found.k2Deviation, "");
  report.figure("residual_px", found.residual_px, -1.0, "px");
  if (found.outliers > 0) report.note("%d markers are not where the others say, and do not count", found.outliers);
  if (found.bulge.found()) {
    report.note("something seems to touch the gel near x %.0f, y %.0f mm, or the lens has a distortion that k1 "
                "and k2 do not describe",
                kMillimetres * found.bulge.place.x(), kMillimetres * found.bulge.place.y());
  }
}

/// Reports what a picture cannot tell if the pose is far from the file's: which length is wrong.
void describeScale(const sensor::Sensor& file, const sensor::Camera& found, Report& report) {
  constexpr double kFar = 0.02;
  const double change = found.position.z() / file.camera.position.z() - 1.0;
  if (std::abs(change) < kFar) return;
  report.note(
      "the camera is %.0f mm %s than in the gel file, if the markers' pitch and depth and focal_px are right; "
      "one picture "
      "does not tell these from the distance: measure ten pitches, and from the lens to the gel's surface about %.0f "
      "mm",
      kMillimetres * std::abs(found.position.z() - file.camera.position.z()), change > 0.0 ? "farther" : "nearer",
      kMillimetres * found.position.z());
}

/// Returns the radius of a layer's markers in the picture, by the distances between them.
double radius_px(const sensor::Sensor& sensor, std::size_t layer, const RestMarkers& markers) {
  std::vector<tractiond::track::Vector> places;
  for (std::size_t i = 0; i < markers.present.size(); ++i) {
    places.push_back({markers.place_px[2 * i], markers.place_px[2 * i + 1]});
  }
  const tractiond::track::Lattice lattice = tractiond::track::latticesOf(sensor)[layer];
  const double spacing_px = tractiond::track::smallestSpacing(places, {&lattice, 1});
  return 0.5 * sensor.layers[layer].diameter / sensor.layers[layer].pitch * spacing_px;
}

/// Draws a line twice: black and wider below its colour, so that it is visible on any picture.
void outlined(const cv::Scalar& colour, auto&& draw) {
  draw(cv::Scalar(0, 0, 0), 4);
  draw(colour, 2);
}

}  // namespace

Done pose(const PoseOptions& options, Report& report) {
  if (const auto free = checkOutput(options.output, options.force); !free) return free;
  auto seen = loadAndFindMarkers(options, report, &options);
  if (!seen) return tl::unexpected(seen.error());
  constexpr int kFewest = tractiond::calibrate::GeometryOptions{}.fewest;
  if (const int count = seen->markers.count(); count < kFewest) {
    return tl::unexpected(Faults{fault(options.picture, "shows too few markers for a pose: " + std::to_string(count),
                                       "at least " + std::to_string(kFewest) + " must be seen")});
  }
  const Geometry found = firstPose(seen->sensor, seen->markers);
  // Markers that scatter as the file says are no fault of it.
  const sensor::MarkerLayer& first = seen->sensor.layers.front();
  const double stated_px = kStatedPlaces * seen->sensor.uncertainty.markerPlace / (0.5 * first.diameter) *
                           radius_px(seen->sensor, 0, seen->markers);
  const double accepted_px = std::max(options.acceptResidual_px, stated_px);
  const bool isGood = found.outcome == Geometry::Outcome::kConverged && found.residual_px <= accepted_px;
  const auto aspect = otherAspect(seen->sensor, seen->markers);
  if (aspect && !isGood) return tl::unexpected(Faults{fault(options.picture, aspect->what(), aspect->remedy())});
  if (found.outcome != Geometry::Outcome::kConverged) {
    return tl::unexpected(Faults{fault(options.picture, "tells no pose: no camera sees the markers there",
                                       "do layers, pitch and thickness in the gel file fit this gel?")});
  }
  sensor::Sensor posed = seen->sensor;
  posed.camera = found.camera;
  posed.uncertainty = found.uncertainty;
  // Whoever accepts a residual accepts it here, too; and another aspect is reported already.
  constexpr bool kJudgesResidual = false;
  const tractiond::GelReport gel = tractiond::calibrate::checkGel(posed, seen->markers.place_px, seen->markers.present,
                                                                  seen->markers.seen, kJudgesResidual);
  const std::string& other = gel.remark;
  if (gel.otherLook || (!gel.fits() && !options.force)) {
    return tl::unexpected(Faults{
        fault(options.picture, "shows another gel than the gel file: " + other,
              gel.otherLook ? "" : "--force writes the pose all the same; the daemon will doubt such a file, too")});
  }
  if (!isGood) {
    char what[120], places[160] = "", remedy[400];
    if (!posed.body) {  // whose file states no such deviation
      std::snprintf(places, sizeof places,
                    "if the markers were placed by hand, write marker_place_mm = %.2f into [uncertainty]; ",
                    kMillimetres * 0.5 * first.diameter * found.residual_px /
                        radius_px(seen->sensor, 0, seen->markers));
    }
    std::snprintf(what, sizeof what,
                  "does not fit the gel file: %.2f px are left of the markers' places, at most %.2f are accepted",
                  found.residual_px, accepted_px);
    std::snprintf(remedy, sizeof remedy,
                  "mend its layers, thickness and indices, or the lens; %s--accept-residual %.1f writes this pose all "
                  "the same, with which forces are less exact",
                  places, std::ceil(10.0 * found.residual_px) / 10.0);
    return tl::unexpected(Faults{fault(options.picture, what, remedy)});
  }
  describe(found, report);
  if (found.residual_px > std::max(PoseOptions{}.acceptResidual_px, stated_px)) {
    report.warning("%.2f px are left of the markers' places, more than %.2f: the gel file does not fit, and forces "
                   "are less exact than their deviations say",
                   found.residual_px, PoseOptions{}.acceptResidual_px);
  }
  if (aspect) report.note("%s: %s", aspect->what().c_str(), aspect->remedy().c_str());
  if (!other.empty()) report.warning("the picture shows another gel than the gel file: %s", other.c_str());
  describeScale(seen->sensor, found.camera, report);
  if (tractiond::calibrate::mayBeMirrored(posed)) {
    report.note(
        "this gel may look the same in a mirrored picture, which mirrors forces: press near its corners, "
        "clockwise as the camera sees them; if contacts do not go clockwise in tractionctl watch, too, from top "
        "left to top right, change ReverseX in camera.features and measure the lens again");
  }
  return writeGel(options.output, std::move(posed), "The camera's pose is from one rest picture, by traction-lens.",
                  report);
}

Done mark(const PictureOptions& options, Report& report) {
  if (!options.output.ends_with(".png")) {
    return tl::unexpected(Faults{{.exitCode = EX_USAGE,
                                  .what = "is no name of a PNG picture, as which it would be written",
                                  .where = options.output,
                                  .remedy = "name it marked.png, for example"}});
  }
  auto seen = loadAndFindMarkers(options, report);
  if (!seen) return tl::unexpected(seen.error());
  cv::Mat marked = seen->picture;
  if (marked.channels() == 1) cv::cvtColor(marked, marked, cv::COLOR_GRAY2BGR);
  constexpr int kZoom = 2, kShift = 4;  // circles are placed to 1/16 pixel
  cv::resize(marked, marked, {}, kZoom, kZoom, cv::INTER_NEAREST);
  const auto placed = [](float px) {  // centre of a pixel in the enlarged picture
    return static_cast<int>(std::lround((kZoom * (px + 0.5F) - 0.5F) * (1 << kShift)));
  };
  std::size_t marker = 0;
  for (std::size_t layer = 0; layer < seen->sensor.layers.size(); ++layer) {
    const int ring = static_cast<int>((kZoom * radius_px(seen->sensor, layer, seen->markers) + 3.0) * (1 << kShift));
    for (int i = 0; i < seen->sensor.layers[layer].count(); ++i, ++marker) {
      const float u = seen->markers.place_px[2 * marker], v = seen->markers.place_px[2 * marker + 1];
      const cv::Point centre(placed(u), placed(v));
      if (seen->markers.present[marker] != 0) {
        outlined(layer == 0 ? cv::Scalar(255, 255, 0) : cv::Scalar(0, 255, 255), [&](const auto& pen, int width) {
          cv::circle(marked, centre, ring, pen, width, cv::LINE_AA, kShift);
        });
      } else {
        const cv::Point arm(4 << kShift, 4 << kShift), other(4 << kShift, -(4 << kShift));
        outlined({0, 0, 255}, [&](const auto& pen, int width) {
          cv::line(marked, centre - arm, centre + arm, pen, width, cv::LINE_AA, kShift);
          cv::line(marked, centre - other, centre + other, pen, width, cv::LINE_AA, kShift);
        });
      }
    }
  }
  if (const auto written = writePicture(options.output, marked); !written) {
    return tl::unexpected(Faults{written.error()});
  }
  report.line("Written: %s; twice as large, circles where markers are, crosses where they are missing",
              options.output.c_str());
  return {};
}

}  // namespace lens

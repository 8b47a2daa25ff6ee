#include "base/quantile.h"
#include "daemon/calibrate/aspect_check.h"
#include "lens/commands.h"
#include "lens/lens_fit.h"
#include "lens/picture_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

namespace lens {

namespace {

constexpr std::size_t kFewest = 5;  // smallest number of pictures
// Corners of two pictures that are nearer to each other than this (root mean square) are one view, again: noise is a
// tenth of a pixel or less, and a hand moves a board by much more.
constexpr double kSameView_px = 1.0;
constexpr double kSmear = 2.5;         // an edge this many times wider than the median's is out of focus or moved
constexpr double kNoOneLens_px = 1.0;  // a larger residual over all pictures: they are not of one lens
constexpr double kPoor_px = 0.25;      // a larger residual over all pictures: more than a good lens and board leave
// Share of the way to the picture's corner up to which corners must be seen to determine the distortion.
constexpr double kReach = 0.7;
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kTilted = 20.0 / kDegrees;  // tilt of a board from which its picture determines the focal length [rad]

/// A picture in which the board was found.
struct View {
  const std::string* file;
  int width, height;
  Corners corners;
  std::string with;  ///< camera and picture, as measuredWith(); empty: not known
};

std::string shape(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height) + " px";
}

std::string fixed(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::vector<View> readViews(const CalibrateOptions& options, Faults& faults) {
  std::vector<View> views;
  for (const std::string& file : options.pictures) {
    const auto picture = readPicture(file);
    if (!picture) {
      faults.push_back(picture.error());
      continue;
    }
    auto corners = findCorners(grey(*picture), options.board);
    if (corners) {
      views.push_back({&file, picture->cols, picture->rows, *std::move(corners), measuredWith(file).text()});
    } else {
      faults.push_back(fault(file, corners.error()));
    }
  }
  return views;
}

/// Returns the size that most pictures have.
std::pair<int, int> usualSize(const std::vector<View>& views) {
  std::map<std::pair<int, int>, int> counts;
  for (const View& view : views) ++counts[{view.width, view.height}];
  return std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
}

/// Returns what the first picture that says so was taken with; empty: none does.
std::string firstCamera(const std::vector<View>& views) {
  const auto found = std::ranges::find_if(views, [](const View& view) { return !view.with.empty(); });
  return found == views.end() ? std::string() : found->with;
}

/// Adds a fault for each picture whose size, camera or sharpness differs from that of the others.
void compare(const std::vector<View>& views, Faults& faults) {
  if (views.empty()) return;
  const auto [width, height] = usualSize(views);
  std::vector<double> widths_px;
  for (const View& view : views) widths_px.push_back(view.corners.edgeWidth_px);
  const double middle_px = tractiond::quantile(widths_px);
  const std::string camera = firstCamera(views);
  for (const View& view : views) {
    if (view.width != width || view.height != height) {
      faults.push_back(
          fault(*view.file, "has " + shape(view.width, view.height) + ", where the others have " + shape(width, height),
                "another camera, or another region of it; all are to be of one camera as it will be used"));
    } else if (!view.with.empty() && view.with != camera) {
      faults.push_back(fault(*view.file, "is of " + view.with + ", where others are of " + camera,
                             "all are to be of one camera as it will be used"));
    } else if (view.corners.edgeWidth_px > kSmear * middle_px) {
      faults.push_back(fault(*view.file,
                             "is blurred: edges are " + fixed(view.corners.edgeWidth_px, 1) + " px wide, " +
                                 fixed(middle_px, 1) + " px in the others",
                             "it was out of focus or moved; leave it out"));
    }
  }
}

/// Leaves out each picture that shows the board where an earlier one does, and reports which. Counted twice, the errors
/// of one view would be taken for those of two.
void leaveOutEqual(std::vector<View>& views, Report& report) {
  std::vector<View> different;
  for (View& view : views) {
    const auto isSame = [&](const View& earlier) {
      // Square boards may be listed from any corner.
      double squares = 0.0;
      for (const auto& place : view.corners.place_px.colwise()) {
        squares += (earlier.corners.place_px.colwise() - place).colwise().squaredNorm().minCoeff();
      }
      return squares <= kSameView_px * kSameView_px * static_cast<double>(view.corners.place_px.cols());
    };
    const auto same = std::ranges::find_if(different, isSame);
    if (same == different.end()) {
      different.push_back(std::move(view));
    } else {
      report.note("%s is left out: it shows the board where %s does, so that its errors are the same; move the "
                  "board between pictures",
                  view.file->c_str(), same->file->c_str());
    }
  }
  views = std::move(different);
}

/// Returns the distance of the farthest corner from the principal point, relative to that of the picture's farthest
/// corner.
double reach(const std::vector<View>& views, const sensor::Camera& camera) {
  double seen = 0.0, whole = 0.0;
  for (const double u : {0.0, camera.width - 1.0}) {
    for (const double v : {0.0, camera.height - 1.0}) {
      whole = std::max(whole, (Eigen::Vector2d(u, v) - camera.principal_px).norm());
    }
  }
  for (const View& view : views) {
    const Eigen::Matrix2Xd fromPrincipal_px = view.corners.place_px.colwise() - camera.principal_px;
    seen = std::max(seen, fromPrincipal_px.colwise().norm().maxCoeff());
  }
  return seen / whole;
}

/// Returns how the squares of a board are not square: "0.50 % wider than high".
std::string oblongInWords(double tall) {
  return fixed(100.0 * std::abs(1.0 / tall - 1.0), 2) + " % " +
         (tall < 1.0 ? "wider than high" : "less wide than high");
}

/// Returns the sides of such squares for the command line, the height being as given: "10.05x10".
std::string squareExample(const Board& board, double tall) {
  char text[60];
  const double height_mm = 1e3 * board.square * board.tall;
  std::snprintf(text, sizeof text, "%.4gx%.4g", height_mm / tall, height_mm);
  return text;
}

void checkFit(const std::vector<View>& views, const LensFit& fit, const Board& board, Faults& faults) {
  const auto listed = [&](const auto& isListed) {
    std::string files;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (isListed(i)) files += (files.empty() ? "" : ", ") + *views[i].file;
    }
    return files;
  };
  if (!fit.isFlipped.empty()) {
    const char* how = fit.flip.y() > 0.0   ? "mirrored left to right"
                      : fit.flip.x() > 0.0 ? "mirrored top to bottom"
                                           : "turned by 180 degrees";
    faults.push_back(fault(listed([&](std::size_t i) { return fit.isFlipped[i]; }),
                           std::string("are ") + how + " against the others, as pictures",
                           "turning the board does not do that, but a camera's or a program's setting does: leave out "
                           "those that tractionctl snapshot would not show so"));
    return;
  }
  // From the front alone no lens is determined, and what is left of a picture says nothing of it.
  const bool isFrontal = fit.outcome != LensFit::Outcome::kDone &&
                         std::ranges::count_if(fit.tilt, [](double tilt) { return tilt >= kTilted; }) < 2;
  if ((fit.oddView && !isFrontal) || fit.residual_px > kNoOneLens_px) {
    const auto worst = std::ranges::max_element(fit.viewResidual_px) - fit.viewResidual_px.begin();
    const auto i = static_cast<std::size_t>(fit.oddView.value_or(static_cast<int>(worst)));
    faults.push_back(fault(*views[i].file,
                           "does not fit the others: " + fixed(fit.viewResidual_px[i], 2) + " px are left of it, " +
                               fixed(fit.residual_px, 2) + " px of all",
                           "another lens or focus, a bent board, or moved while it was taken; leave it out"));
  }
  if (!faults.empty()) return;
  const std::string files = listed([](std::size_t) { return true; });
  const bool isEither = fit.scale == Scale::kEither;
  if (isEither) {
    faults.push_back(fault(files,
                           "do not tell whether the board's squares are oblong" +
                               (fit.tall == 1.0 ? "" : " (" + oblongInWords(fit.tall) + ")") +
                               " or the camera's pixels are (aspect " + fixed(fit.otherAspect, 4) + ")",
                           "measure ten squares along both sides of the board and write both, as in --square-mm " +
                               squareExample(board, fit.tall) +
                               ", or add pictures with the board turned by 90 degrees"));
  }
  // The lens of the expected aspect leaves much then, which looks like too few pictures.
  if (fit.outcome == LensFit::Outcome::kDone || (isEither && !isFrontal)) return;
  std::string what = "do not tell the focal length",
              remedy = "tilt the board by 20 to 45 degrees, to each side in turn";
  if (fit.outcome == LensFit::Outcome::kDegenerate) {
    const auto tilted = std::ranges::count_if(fit.tilt, [](double tilt) { return tilt >= kTilted; });
    what += ": it would be known to " + fixed(100.0 * fit.focalDeviation_px / fit.camera.focal_px, 1) + " % only; " +
            std::to_string(tilted) + " of " + std::to_string(views.size()) +
            " pictures show the board tilted by 20 degrees or more";
    if (2 * tilted > std::ssize(views)) {
      remedy = "take more pictures, with the board larger in them, flat, and tilted to each side in turn";
    }
  }
  faults.push_back(fault(files, what, remedy));
}

/// \param aspect expected one
void describe(const std::vector<View>& views, const LensFit& fit, const Board& board, double aspect, Report& report) {
  report.line("%zu pictures of a chessboard of %d x %d squares, %s:", views.size(), board.columns, board.rows,
              shape(fit.camera.width, fit.camera.height).c_str());
  for (std::size_t i = 0; i < views.size(); ++i) {
    report.item("%-32s tilted %2.0f degrees, edges %.1f px wide, %.3f px left", views[i].file->c_str(),
                fit.tilt[i] * kDegrees, views[i].corners.edgeWidth_px, fit.viewResidual_px[i]);
  }
  report.line("The lens, with standard deviations:");
  report.figure("focal_px", fit.camera.focal_px, fit.focalDeviation_px, "px");
  if (fit.aspectDeviation || fit.camera.aspect != 1.0) {
    report.figure("aspect", fit.camera.aspect, fit.aspectDeviation.value_or(-1.0), "");
  }
  report.figure("principal_u_px", fit.camera.principal_px.x(), fit.principalDeviation_px.x(), "px");
  report.figure("principal_v_px", fit.camera.principal_px.y(), fit.principalDeviation_px.y(), "px");
  report.figure("k1", fit.camera.k1, fit.k1Deviation, "");
  report.figure("k2", fit.camera.k2, fit.k2Deviation, "");
  if (fit.camera.fisheye) {
    report.figure("k3", fit.camera.k3, fit.k3Deviation, "");
    report.figure("k4", fit.camera.k4, fit.k4Deviation, "");
  }
  report.figure("residual_px", fit.residual_px, -1.0, "px");
  if (fit.residual_px > kPoor_px) {
    report.note(
        "%.2f px are left of each coordinate, where a sharp picture of a flat board leaves 0.1 px or less: "
        "look at "
        "the pictures that leave most, and whether the board is flat; a lens of another model (--fisheye) leaves more "
        "towards the picture's corners",
        fit.residual_px);
  }
  if (fit.aspectDeviation) {
    const tractiond::calibrate::AspectSeen seen{.expected = aspect, .aspect = fit.camera.aspect};
    report.note("%s: the pixels have another shape, or the pictures were resized; the gel file is given "
                "camera.aspect = %.4f. If the pixels are square, measure ten squares along both sides of the board",
                seen.what().c_str(), fit.camera.aspect);
  }
  if (fit.scale == Scale::kBoard) {
    report.note("the board's squares are %s (+- %.2f %%), by the pictures; the lens takes that into account. "
                "Measure ten squares along both sides, and write both, as in --square-mm %s",
                oblongInWords(fit.tall).c_str(), 100.0 * fit.tallDeviation, squareExample(board, fit.tall).c_str());
  }
  const double seen = reach(views, fit.camera);
  if (seen < kReach) {
    report.note("the board was seen in the middle of the picture only, up to %.0f %% of the way to its corners: "
                "k1 and k2 say nothing of what lies beyond",
                100.0 * seen);
  }
}

}  // namespace

Done findBoard(const std::string& file, const Board& board, Report& report) {
  const auto picture = readPicture(file);
  if (!picture) return tl::unexpected(Faults{picture.error()});
  const auto found = findCorners(grey(*picture), board);
  if (!found) return tl::unexpected(Faults{fault(file, found.error())});
  report.line("The outermost corners between four squares, around the board:");
  const int across = board.columns - 1, last = board.corners() - 1;
  int number = 0;
  for (const int corner : {0, across - 1, last, last - across + 1}) {
    const std::string name = "corner" + std::to_string(++number);
    report.figure(name + "_u_px", found->place_px(0, corner), -1.0, "px");
    report.figure(name + "_v_px", found->place_px(1, corner), -1.0, "px");
  }
  report.figure("edge_px", found->edgeWidth_px, -1.0, "px");
  report.figure("square_px", found->smallestSquare_px, -1.0, "px");
  return {};
}

Done calibrate(const CalibrateOptions& options, Report& report) {
  auto sensor = loadGel(options.gel);
  if (!sensor) return tl::unexpected(sensor.error());
  if (const auto free = checkOutput(options.output, options.force); !free) return free;
  Faults faults;
  std::vector<View> views = readViews(options, faults);
  compare(views, faults);
  if (!faults.empty()) return tl::unexpected(faults);
  leaveOutEqual(views, report);
  if (views.size() < kFewest) {
    return tl::unexpected(Faults{fault("", std::to_string(views.size()) + " different pictures are too few for a lens",
                                       "at least " + std::to_string(kFewest) + ", better 15, each from another side")});
  }
  const auto [width, height] = usualSize(views);
  sensor::Camera& camera = sensor->camera;
  if (!statesOfCamera(options.gel, "width_px")) camera.width = width;
  if (!statesOfCamera(options.gel, "height_px")) camera.height = height;
  if (camera.width != width || camera.height != height) {
    return tl::unexpected(Faults{fault(
        options.gel, "has a camera of " + shape(camera.width, camera.height) + ", the pictures " + shape(width, height),
        "take them with the camera's region of use, or mend camera.width_px and "
        "camera.height_px")});
  }
  std::vector<Corners> corners;
  for (const View& view : views) corners.push_back(view.corners);
  LensFitOptions fitOptions;
  fitOptions.aspect = camera.aspect;
  fitOptions.boardIsMeasured = options.boardIsMeasured;
  fitOptions.fisheye = options.fisheye || camera.fisheye;
  const LensFit fit = fitLens(corners, options.board, width, height, fitOptions);
  checkFit(views, fit, options.board, faults);
  if (faults.empty() && sensor::foldOf(fit.camera)) {
    faults.push_back(fault("", "the fisheye that explains the pictures folds before the picture's corners",
                           "take more pictures, with the board up to the picture's corners"));
  }
  if (!faults.empty()) return tl::unexpected(faults);
  describe(views, fit, options.board, fitOptions.aspect, report);
  if (std::ranges::count(views, std::string(), &View::with) > 0) {
    report.note("not all pictures say which camera took them, as those of tractionctl snapshot do: their size alone "
                "was compared");
  }
  const std::string with = firstCamera(views);  // empty: the lens may be another camera's than the file's was
  if (!with.empty() && !sensor->measuredWith.empty() && sensor->measuredWith != with) {
    report.note("the gel file's pose was measured with %s: find it anew (traction-lens pose)",
                sensor->measuredWith.c_str());
  }
  sensor->measuredWith = with;

  camera.focal_px = fit.camera.focal_px;
  camera.aspect = fit.camera.aspect;
  camera.principal_px = fit.camera.principal_px;
  camera.k1 = fit.camera.k1;
  camera.k2 = fit.camera.k2;
  camera.fisheye = fit.camera.fisheye;
  camera.k3 = fit.camera.k3;
  camera.k4 = fit.camera.k4;
  sensor::Uncertainty& uncertainty = sensor->uncertainty;
  // Includes the focal length along u and along v.
  uncertainty.focal =
      std::hypot(fit.focalDeviation_px / fit.camera.focal_px, fit.aspectDeviation.value_or(0.0) / fit.camera.aspect);
  uncertainty.focalDistance = 0.0;
  uncertainty.principal_px = fit.principalDeviation_px.maxCoeff();
  uncertainty.k1 = fit.k1Deviation;
  uncertainty.k2 = fit.k2Deviation;
  return writeGel(options.output, *std::move(sensor),
                  "The lens is from " + std::to_string(views.size()) + " pictures of a chessboard, by traction-lens.",
                  report);
}

}  // namespace lens

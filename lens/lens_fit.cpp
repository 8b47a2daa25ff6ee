#include "lens/lens_fit.h"

#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lens {

namespace {

// Focal length, principal point, k1, k2 and of a fisheye k3, k4; then the aspect or the board's, if it is estimated.
constexpr int kPinhole = 5, kFisheye = 7, kMostLens = 8;
constexpr int kPose = 6;
constexpr double kAny = 0.0;      // instead of an aspect: it is estimated
constexpr double kGood_px = 1.0;  // a smaller residual shows that the right minimum was found
constexpr double kLittle_px = 0.1;
constexpr double kFrontal = 10.0 * CV_PI / 180.0;
constexpr double kMostOblong = 0.1;  // a printer's or a copier's fault, relative
// Deviations of noise by which flipping a view must explain it better, ...
constexpr double kFlipped = 8.0;
// ... and deviations of a single view's principal point by which that must be off the middle: choosing the better side
// for each view makes up to 1.3 of none.
constexpr double kFarFlipped = 4.0;
constexpr int kFisheyeSteps = 8;
constexpr int kBoardSteps = 8;
constexpr double kBoardSettled = 1e-7;

/// Size of the pictures [px], and the model of the lens.
struct Picture {
  int width, height;
  bool fisheye;
};

/// The camera in OpenCV's form.
struct Model {
  cv::Mat matrix = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat distortion = cv::Mat::zeros(5, 1, CV_64F);
  std::vector<cv::Mat> rotations, translations;
  double residual_px = -1.0;
  bool ownAspect = false;  ///< true: the aspect was estimated
  bool fisheye = false;

  double focal_px() const { return matrix.at<double>(0, 0); }
  double aspect() const { return matrix.at<double>(1, 1) / matrix.at<double>(0, 0); }
  bool isFinite() const {
    if (!(residual_px >= 0.0) || !cv::checkRange(matrix) || !cv::checkRange(distortion)) return false;
    const auto finite = [](const cv::Mat& m) { return cv::checkRange(m); };
    return std::ranges::all_of(rotations, finite) && std::ranges::all_of(translations, finite);
  }
  int figures() const { return fisheye ? kFisheye : kPinhole; }

  /// Projects points of a view's board.
  /// \param[out] jacobian a row for each coordinate: by rotation, translation, fx, fy, cx, cy, k1, k2 ...
  std::vector<cv::Point2d> project(const std::vector<cv::Point3d>& points, std::size_t view,
                                   Eigen::MatrixXd* jacobian = nullptr) const {
    std::vector<cv::Point2d> places;
    cv::Mat derivatives;
    if (fisheye) {
      cv::fisheye::projectPoints(points, places, rotations[view], translations[view], matrix, distortion, 0.0,
                                 derivatives);
    } else {
      cv::projectPoints(points, rotations[view], translations[view], matrix, distortion, places, derivatives);
    }
    if (!jacobian) return places;
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(
        derivatives.ptr<double>(), derivatives.rows, derivatives.cols);
    *jacobian = all;
    if (fisheye) *jacobian << all.middleCols(8, 6), all.leftCols(8), all.rightCols(1);  // OpenCV has the pose last
    return places;
  }
};

template <typename Point = cv::Point3d>
std::vector<Point> onBoard(const Board& board) {
  std::vector<Point> points;
  for (int i = 0; i < board.corners(); ++i) {
    // Lengths are in squares: the size of the board affects only the poses.
    const Eigen::Vector2f place = (board.corner(i) / board.square).cast<float>();
    points.emplace_back(place.x(), place.y(), 0);
  }
  return points;
}

/// Fits the camera.
/// \param guess start value of the focal length in picture widths; 0: from the views' homographies
Model calibrated(const std::vector<Corners>& views, const Board& board, const Picture& size, double aspect,
                 double guess) {
  std::vector<std::vector<cv::Point2f>> seen;
  for (const Corners& view : views) {
    auto& places = seen.emplace_back();
    for (const auto& place : view.place_px.colwise()) {
      places.emplace_back(static_cast<float>(place.x()), static_cast<float>(place.y()));
    }
  }
  const std::vector<std::vector<cv::Point3f>> points(views.size(), onBoard<cv::Point3f>(board));
  int flags = cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3;
  Model model;
  model.ownAspect = aspect == kAny;
  const double startAspect = model.ownAspect ? 1.0 : aspect;
  if (!model.ownAspect) {
    flags |= cv::CALIB_FIX_ASPECT_RATIO;  // uses the ratio in the matrix, even if nothing else of the matrix is used
    model.matrix.at<double>(1, 1) = aspect;
  }
  if (guess > 0.0) {
    flags |= cv::CALIB_USE_INTRINSIC_GUESS;
    model.matrix = (cv::Mat_<double>(3, 3) << guess * size.width, 0, 0.5 * (size.width - 1), 0,
                    startAspect * guess * size.width, 0.5 * (size.height - 1), 0, 0, 1);
  }
  try {
    model.residual_px =
        cv::calibrateCamera(points, seen, {size.width, size.height}, model.matrix, model.distortion, model.rotations,
                            model.translations, flags, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12});
  } catch (const cv::Exception&) {  // the views give no start value
    model.residual_px = -1.0;
  }
  return model;
}

Model fisheye(const std::vector<Corners>& views, const Board& board, const Picture& size, double aspect);

Model best(const std::vector<Corners>& views, const Board& board, const Picture& size, double aspect) {
  if (size.fisheye) return fisheye(views, board, size, aspect);
  Model found;
  for (const double guess : {0.0, 1.0, 2.0, 4.0}) {
    Model model = calibrated(views, board, size, aspect, guess);
    if (!model.isFinite() || !(model.focal_px() > 0.0) || !(model.aspect() > 0.0)) continue;
    if (!found.isFinite() || model.residual_px < 0.99 * found.residual_px) found = std::move(model);
    if (found.residual_px < kGood_px) break;
  }
  return found;
}

enum class Extra { kNone, kAspect, kBoard };

/// Information of the views about the lens, with the poses eliminated, and the residuals of the corners.
class Information {
 public:
  using Lens = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostLens, kMostLens>;
  using Figures = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostLens, 1>;

  /// \param extra what is estimated beside the lens
  Information(const Model& model, Extra extra, const std::vector<Corners>& views, const Board& board)
      : model_(model)
      , extra_(extra)
      , figures_(model.figures() + (extra == Extra::kNone ? 0 : 1))
      , information_(Lens::Zero(figures_, figures_)) {
    for (std::size_t i = 0; i < views.size(); ++i) add(views[i], board, i);
  }
  Information(const Model& model, const std::vector<Corners>& views, const Board& board)
      : Information(model, model.ownAspect ? Extra::kAspect : Extra::kNone, views, board) {}

  /// Returns the standard deviations of focal length, principal point, k1, k2 and, if it is estimated, aspect: the
  /// larger of two estimates for each. They are not finite if the views do not determine them.
  Figures deviations() const { return ofNoise().cwiseMax(ofViews()).cwiseSqrt(); }

  /// Returns the Gauss-Newton step of what is estimated beside the lens.
  double step() const { return steps()[extraIndex()]; }

  /// Returns the model after a Gauss-Newton step of the lens, the poses and, if it is estimated, the aspect.
  Model stepped() const {
    const Figures change = steps();
    Model model = model_;
    model.matrix = model_.matrix.clone();
    model.distortion = model_.distortion.clone();
    const double aspect = model_.aspect() + (extra_ == Extra::kAspect ? change[extraIndex()] : 0.0);
    model.matrix.at<double>(0, 0) += change[0];
    model.matrix.at<double>(1, 1) = aspect * model.focal_px();
    for (int k = 0; k < 2; ++k) model.matrix.at<double>(k, 2) += change[1 + k];
    for (int k = 3; k < model.figures(); ++k) model.distortion.at<double>(k - 3) += change[k];
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Eigen::Matrix<double, kPose, 1> pose = views_[i].poseStep - views_[i].byFigures * change;
      model.rotations[i] = cv::Mat(model_.rotations[i] + cv::Mat(cv::Vec3d(pose[0], pose[1], pose[2])));
      model.translations[i] = cv::Mat(model_.translations[i] + cv::Mat(cv::Vec3d(pose[3], pose[4], pose[5])));
    }
    return model;
  }

 private:
  Figures steps() const {
    const Figures scale = information_.diagonal().cwiseSqrt().cwiseInverse();
    Figures pull = Figures::Zero(figures_);
    for (const View& view : views_) pull += view.pull;
    const Figures scaled = scale.asDiagonal() * pull;
    return scale.asDiagonal() * factorOf(information_, scale).solve(scaled);
  }

 public:
  /// Returns which views to flip in the picture so that one lens explains all best, to second order in the lens: each
  /// time the one that takes most squares.
  /// \param sign -1 along the coordinates that are flipped, else 1
  std::vector<bool> flipped(const Eigen::Vector2d& sign, const Eigen::Vector2d& last_px) const {
    // To flip a picture is to flip the principal point of its lens.
    const Eigen::Vector2d principal_px(model_.matrix.at<double>(0, 2), model_.matrix.at<double>(1, 2));
    const Figures none = Figures::Zero(figures_), one = Figures::Ones(figures_);
    Figures side = one, shift = none;
    side.segment<2>(1) = sign;
    shift.segment<2>(1) = (0.5 * (Eigen::Vector2d::Ones() - sign)).cwiseProduct(last_px - 2.0 * principal_px);
    std::vector<bool> flipped(views_.size(), false);
    const auto squares = [&] {
      Lens sum = Lens::Zero(figures_, figures_);
      Figures pull = Figures::Zero(figures_);
      double left = squares_;
      for (std::size_t i = 0; i < views_.size(); ++i) {
        const Figures by = flipped[i] ? shift : none, to = flipped[i] ? side : one;
        sum += to.asDiagonal() * views_[i].ofLens * to.asDiagonal();
        pull += to.asDiagonal() * (views_[i].pull - views_[i].ofLens * by);
        left += by.dot(views_[i].ofLens * by - 2.0 * views_[i].pull);
      }
      const Figures scale = sum.diagonal().cwiseSqrt().cwiseInverse(), scaled = scale.asDiagonal() * pull;
      return left - scaled.dot(factorOf(sum, scale).solve(scaled));
    };
    double least = squares_;
    for (std::optional<std::size_t> best = 0; best;) {
      best.reset();
      for (std::size_t i = 0; i < views_.size(); ++i) {
        flipped[i] = !flipped[i];
        const double left = squares();
        flipped[i] = !flipped[i];
        if (left >= least) continue;
        least = left;
        best = i;
      }
      if (best) flipped[*best] = !flipped[*best];
    }
    const auto count = std::ranges::count(flipped, true);
    if (2 * count > std::ssize(flipped)) flipped.flip();
    return flipped;
  }

  double squares() const { return squares_; }
  /// Returns the sum of squares of a view.
  double squaresOf(std::size_t view) const { return views_[view].squares; }
  /// Returns the standard deviation of a coordinate, from the residuals.
  double scatter_px() const { return std::sqrt(squares_ / static_cast<double>(freedom())); }
  double residual_px() const { return std::sqrt(squares_ / static_cast<double>(coordinates_)); }

  std::vector<double> residuals_px;

 private:
  struct View {
    Lens ofLens;   ///< information about the lens, with the pose eliminated, for a noise of 1 px [1 / px^2]
    Figures pull;  ///< half the gradient of its squares, with the pose eliminated; the sum over the views is 0
    double squares;
    Eigen::Index coordinates;
    Eigen::Matrix<double, kPose, 1> poseStep;                                     ///< Gauss-Newton step of the pose ...
    Eigen::Matrix<double, kPose, Eigen::Dynamic, 0, kPose, kMostLens> byFigures;  ///< ... less this times the lens's
  };

  void add(const Corners& view, const Board& board, std::size_t index) {
    Eigen::MatrixXd jacobian;
    const std::vector<cv::Point2d> places = model_.project(onBoard(board), index, &jacobian);
    const auto rows = static_cast<Eigen::Index>(2 * places.size());
    Eigen::MatrixXd byLens(rows, figures_), byPose(rows, kPose);
    Eigen::VectorXd left(rows);
    for (int i = 0; i < static_cast<int>(rows); ++i) {
      const Eigen::RowVectorXd row = jacobian.row(i);
      byPose.row(i) = row.head<kPose>();
      // fx is the focal length, fy = aspect fx.
      byLens(i, 0) = row[6] + model_.aspect() * row[7];
      for (int k = 1; k < model_.figures(); ++k) byLens(i, k) = row[7 + k];
      if (extra_ == Extra::kAspect) byLens(i, extraIndex()) = model_.focal_px() * row[7];
      const cv::Point2d place = places[static_cast<std::size_t>(i / 2)];
      left[i] = view.place_px(i % 2, i / 2) - (i % 2 == 0 ? place.x : place.y);
    }
    if (extra_ == Extra::kBoard) byLens.col(extraIndex()) = byBoard(board, index);
    const Eigen::Matrix<double, kPose, kPose> ofPose = byPose.transpose() * byPose;
    const Eigen::Matrix<double, kPose, Eigen::Dynamic, 0, kPose, kMostLens> mixed = byPose.transpose() * byLens;
    const Eigen::LDLT<Eigen::Matrix<double, kPose, kPose>> poseFactor(ofPose);
    const Lens ofLens = byLens.transpose() * byLens - mixed.transpose() * poseFactor.solve(mixed);
    const Figures pull = byLens.transpose() * left - mixed.transpose() * poseFactor.solve(byPose.transpose() * left);
    const double squares = left.squaredNorm();
    information_ += ofLens;
    views_.push_back(
        {ofLens, pull, squares, rows, poseFactor.solve(byPose.transpose() * left), poseFactor.solve(mixed)});
    squares_ += squares;
    coordinates_ += rows;
    residuals_px.push_back(std::sqrt(squares / static_cast<double>(rows)));
  }

  /// Returns the derivatives of a view's coordinates by Board::tall.
  Eigen::VectorXd byBoard(const Board& board, std::size_t index) const {
    constexpr double kStep = 1e-4;
    Eigen::VectorXd change = Eigen::VectorXd::Zero(2 * board.corners());
    for (const double side : {1.0, -1.0}) {
      Board other = board;
      other.tall += side * kStep;
      std::vector<cv::Point3d> points;
      for (int i = 0; i < board.corners(); ++i) {
        const Eigen::Vector2d place = other.corner(i) / other.square;
        points.emplace_back(place.x(), place.y(), 0.0);
      }
      const std::vector<cv::Point2d> seen = model_.project(points, index);
      for (int i = 0; i < board.corners(); ++i) {
        change[2 * i] += side / (2.0 * kStep) * seen[static_cast<std::size_t>(i)].x;
        change[2 * i + 1] += side / (2.0 * kStep) * seen[static_cast<std::size_t>(i)].y;
      }
    }
    return change;
  }

  Eigen::LDLT<Lens> factorOf(const Lens& information, const Figures& scale) const {
    return Eigen::LDLT<Lens>(scale.asDiagonal() * information * scale.asDiagonal());
  }

  /// Returns the variances for independent errors of the corners. Every view has its own noise s_v, from its residuals.
  /// The fit weights all views equally, so the covariance is A^-1 (sum s_v^2 A_v) A^-1, A = sum A_v.
  Figures ofNoise() const {
    const Figures scale = information_.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Lens> factor = factorOf(information_, scale);
    const Lens inverse = factor.solve(Lens::Identity(figures_, figures_)),
               covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
    Lens noise = Lens::Zero(figures_, figures_);
    for (const View& view : views_) {
      // number of the lens's degrees of freedom that this view determines
      const double taken = (covariance * view.ofLens).trace();
      noise += view.squares / (static_cast<double>(view.coordinates) - kPose - taken) * view.ofLens;
    }
    return (covariance * noise * covariance).diagonal();
  }

  /// Returns the variances for independent views: how much the lens changes without each view (jackknife, to first
  /// order). In real pictures the errors of corners are correlated within a view: by a board that is not flat, by light
  /// from one side, by a lens of another model.
  Figures ofViews() const {
    const auto count = static_cast<double>(views_.size());
    const Figures scale = information_.diagonal().cwiseSqrt().cwiseInverse();
    Figures squares = Figures::Zero(figures_);
    for (const View& view : views_) {
      const Figures scaled = scale.asDiagonal() * view.pull;
      const Figures change = scale.asDiagonal() * factorOf(information_ - view.ofLens, scale).solve(scaled);
      squares += change.cwiseAbs2();
    }
    return (count - 1.0) / count * squares;
  }

  Eigen::Index extraIndex() const { return figures_ - 1; }
  Eigen::Index freedom() const { return coordinates_ - figures_ - kPose * static_cast<Eigen::Index>(views_.size()); }

  const Model& model_;
  Extra extra_;
  Eigen::Index figures_;
  Lens information_;
  std::vector<View> views_;
  double squares_ = 0.0;
  Eigen::Index coordinates_ = 0;
};

/// Fits a fisheye. OpenCV cannot hold its aspect: Gauss-Newton steps refine what it finds.
Model fisheye(const std::vector<Corners>& views, const Board& board, const Picture& size, double aspect) {
  std::vector<std::vector<cv::Point2d>> seen;
  for (const Corners& view : views) {
    auto& places = seen.emplace_back();
    for (const auto& place : view.place_px.colwise()) places.emplace_back(place.x(), place.y());
  }
  const std::vector<std::vector<cv::Point3d>> points(views.size(), onBoard(board));
  Model found;
  for (const double guess : {0.4, 0.3, 0.6, 1.0}) {  // of the focal length, in picture widths
    Model model;
    model.fisheye = true;
    model.ownAspect = aspect == kAny;
    const double start = model.ownAspect ? 1.0 : aspect;
    model.matrix = (cv::Mat_<double>(3, 3) << guess * size.width, 0, 0.5 * (size.width - 1), 0,
                    start * guess * size.width, 0.5 * (size.height - 1), 0, 0, 1);
    model.distortion = cv::Mat::zeros(4, 1, CV_64F);
    try {
      std::vector<cv::Mat> rotations, translations;
      cv::fisheye::calibrate(
          points, seen, {size.width, size.height}, model.matrix, model.distortion, rotations, translations,
          cv::fisheye::CALIB_USE_INTRINSIC_GUESS | cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
          {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-10});
      for (const cv::Mat& each : rotations) model.rotations.push_back(each.reshape(1, 3));
      for (const cv::Mat& each : translations) model.translations.push_back(each.reshape(1, 3));
      if (!model.ownAspect) model.matrix.at<double>(1, 1) = aspect * model.focal_px();
      for (int step = 0; step < kFisheyeSteps; ++step) {
        model = Information(model, views, board).stepped();
        if (!cv::checkRange(model.matrix)) break;
      }
      model.residual_px = Information(model, views, board).residual_px();
    } catch (const cv::Exception&) {  // it did not settle from there
      continue;
    }
    if (!model.isFinite() || !(model.focal_px() > 0.0) || !(model.aspect() > 0.0)) continue;
    if (!found.isFinite() || model.residual_px < 0.99 * found.residual_px) found = std::move(model);
    if (found.residual_px < kGood_px) break;
  }
  return found;
}

double tiltOf(const cv::Mat& rotation) {
  cv::Mat turn;
  cv::Rodrigues(rotation, turn);
  return std::acos(std::min(1.0, std::abs(turn.at<double>(2, 2))));
}

/// Returns the sum of squares of the other views, fitted without this one.
double squaresWithout(std::size_t left, std::vector<Corners> views, const Board& board, const Picture& size,
                      double aspect, double* scatter_px) {
  views.erase(views.begin() + static_cast<std::ptrdiff_t>(left));
  const Model model = best(views, board, size, aspect);
  if (!model.isFinite()) return std::numeric_limits<double>::infinity();
  const Information rest(model, views, board);
  *scatter_px = rest.scatter_px();
  return rest.squares();
}

/// Returns the view that adds most to the sum of squares, if that is far above the others' residual without it. Its own
/// residual need not be the largest: one view through another lens bends the fit, and all views share the error. If the
/// residual is small, only the worst view is tried.
std::optional<int> oddView(const std::vector<Corners>& views, const Board& board, const Picture& size, double aspect,
                           const Information& all, const LensFitOptions& options) {
  if (views.size() < 4) return std::nullopt;
  const auto worst = static_cast<std::size_t>(std::ranges::max_element(all.residuals_px) - all.residuals_px.begin());
  double least = std::numeric_limits<double>::infinity(), scatter_px = 0.0;
  std::size_t odd = worst;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i != worst && all.scatter_px() < kLittle_px) continue;
    double scatter = 0.0;
    const double squares = squaresWithout(i, views, board, size, aspect, &scatter);
    if (squares >= least) continue;
    least = squares;
    scatter_px = scatter;
    odd = i;
  }
  const double added = std::sqrt(std::max(0.0, all.squares() - least) / (2.0 * board.corners() - kPose));
  if (added <= std::max(options.odd * scatter_px, options.leastOdd_px)) return std::nullopt;
  return static_cast<int>(odd);
}

/// A fit in which the board's squares have their own sides.
struct Oblong {
  Board board;
  Model model;
};

/// Estimates Board::tall with the lens, by Gauss-Newton steps. Returns nothing if it does not settle near the given
/// one.
std::optional<Oblong> oblong(const std::vector<Corners>& views, Board board, const Picture& size, double aspect) {
  const double given = board.tall;
  for (int step = 0; step < kBoardSteps; ++step) {
    Model model = best(views, board, size, aspect);
    if (!model.isFinite()) return std::nullopt;
    const double change = Information(model, Extra::kBoard, views, board).step();
    if (!(std::abs(board.tall + change - given) < kMostOblong * given)) return std::nullopt;
    if (std::abs(change) < kBoardSettled) return Oblong{board, std::move(model)};
    board.tall += change;
  }
  return Oblong{board, best(views, board, size, aspect)};
}

/// Returns by how many deviations the second fit explains the views better than the first (Vuong 1989): the mean
/// difference of the views' squares over its own deviation. Infinite if its squares are fewer by a large factor.
double better(const Information& first, const Information& second, std::size_t views, double farBetter) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  if (first.squares() > farBetter * second.squares()) return kFar;
  if (second.squares() > farBetter * first.squares()) return -kFar;
  const auto count = static_cast<double>(views);
  const double mean = (first.squares() - second.squares()) / count;
  double squares = 0.0;
  for (std::size_t i = 0; i < views; ++i) squares += std::pow(first.squaresOf(i) - second.squaresOf(i) - mean, 2);
  return mean / std::sqrt(squares / (count - 1.0) / count);
}

/// Sets which pictures are flipped against the others, if they are and it matters: the other lens is far from this one.
void seekFlipped(const std::vector<Corners>& views, const Board& board, const Picture& size, const Information& all,
                 LensFit& fit) {
  const Eigen::Vector2d last_px(size.width - 1, size.height - 1);
  double least = all.squares();
  for (const Eigen::Vector2d& sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(-1, 1), Eigen::Vector2d(1, -1)}) {
    const std::vector<bool> isFlipped = all.flipped(sign, last_px);
    const auto count = static_cast<double>(std::ranges::count(isFlipped, true));
    if (count == 0.0) continue;
    std::vector<Corners> straight = views;
    const Eigen::Vector2d middle_px = 0.5 * last_px;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (!isFlipped[i]) continue;
      Eigen::Matrix2Xd& place_px = straight[i].place_px;
      place_px = (sign.asDiagonal() * (place_px.colwise() - middle_px)).colwise() + middle_px;
      // A board that is mirrored is listed from the other end of each row.
      for (int row = 0; sign.prod() < 0.0 && row < board.rows - 1; ++row) {
        auto places = place_px.middleCols(row * (board.columns - 1), board.columns - 1);
        places = places.rowwise().reverse().eval();
      }
    }
    const Model model = best(straight, board, size, kAny);
    if (!model.isFinite()) continue;
    const Information information(model, straight, board);
    const Eigen::Vector2d principal_px(model.matrix.at<double>(0, 2), model.matrix.at<double>(1, 2)),
        deviations = (principal_px - middle_px).cwiseQuotient(information.deviations().segment<2>(1));
    const double far = kFarFlipped * std::sqrt(static_cast<double>(views.size())),
                 byNoise = kFlipped * kFlipped * std::pow(information.scatter_px(), 2) * count;
    if (information.squares() >= std::min(least, all.squares() - byNoise)) continue;
    if (!(((1.0 - sign.array()) * deviations.array().abs()).maxCoeff() > 2.0 * far)) continue;
    least = information.squares();
    fit.flip = sign;
    fit.isFlipped = isFlipped;
  }
}

/// Returns what explains the views, and sets in `fit` what that is, and what was tried.
Oblong explain(const std::vector<Corners>& views, const Board& board, const Picture& size,
               const LensFitOptions& options, LensFit& fit) {
  Oblong found{board, best(views, board, size, options.aspect)};
  const auto isOther = [&](double value, double expected, double deviation) {
    const double off = std::abs(value - expected);
    return std::isfinite(deviation) &&
           off > std::max(options.otherAspect * deviation, options.leastOtherAspect * expected);
  };
  Model pixels = best(views, board, size, kAny);
  if (!pixels.isFinite()) return found;
  const Information ofPixels(pixels, views, board);
  seekFlipped(views, board, size, ofPixels, fit);
  fit.otherAspect = pixels.aspect();
  const bool otherPixels = isOther(pixels.aspect(), options.aspect, ofPixels.deviations().tail<1>()[0]);
  std::optional<Oblong> other;
  const bool isSquare = board.columns == board.rows;  // it may lie either way
  if (!options.boardIsMeasured && !isSquare) other = oblong(views, board, size, options.aspect);
  if (!other || !other->model.isFinite()) {
    if (otherPixels) fit.scale = isSquare && !options.boardIsMeasured ? Scale::kEither : Scale::kPixels;
    if (fit.scale == Scale::kPixels) found.model = std::move(pixels);
    return found;
  }
  const Information ofBoard(other->model, Extra::kBoard, views, other->board);
  fit.tall = other->board.tall;
  fit.tallDeviation = ofBoard.deviations().tail<1>()[0];
  const bool otherBoard = isOther(fit.tall, board.tall, fit.tallDeviation);
  if (!otherPixels && !otherBoard) return found;
  const double boardIsBetter = better(ofPixels, ofBoard, views.size(), options.farBetter);
  if (boardIsBetter > options.better) {
    if (!otherBoard) return found;
    fit.scale = Scale::kBoard;
    return *std::move(other);
  }
  if (boardIsBetter < -options.better) {
    if (!otherPixels) return found;
    fit.scale = Scale::kPixels;
    found.model = std::move(pixels);
  } else {
    fit.scale = Scale::kEither;
  }
  return found;
}

}  // namespace

LensFit fitLens(const std::vector<Corners>& views, const Board& asGiven, int width_px, int height_px,
                const LensFitOptions& options) {
  LensFit fit;
  const Picture size{width_px, height_px, options.fisheye};
  const auto [board, model] = explain(views, asGiven, size, options, fit);
  if (!model.isFinite()) return {};
  const Information information(model,
                                model.ownAspect              ? Extra::kAspect
                                : fit.scale == Scale::kBoard ? Extra::kBoard
                                                             : Extra::kNone,
                                views, board);
  for (const cv::Mat& rotation : model.rotations) fit.tilt.push_back(tiltOf(rotation));
  // Where the aspect that is held may be wrong, what it leaves of a view says nothing of that view.
  const bool isEither = fit.scale == Scale::kEither;
  const Model free = isEither ? best(views, board, size, kAny) : model;
  const Information left = isEither ? Information(free, Extra::kAspect, views, board) : information;
  fit.viewResidual_px = left.residuals_px;
  fit.residual_px = left.residual_px();
  fit.oddView = oddView(views, board, size, isEither || model.ownAspect ? kAny : options.aspect, left, options);
  fit.camera.width = width_px;
  fit.camera.height = height_px;
  fit.camera.focal_px = model.focal_px();
  fit.camera.aspect = model.ownAspect ? model.aspect() : options.aspect;
  fit.camera.principal_px = {model.matrix.at<double>(0, 2), model.matrix.at<double>(1, 2)};
  fit.camera.k1 = model.distortion.at<double>(0);
  fit.camera.k2 = model.distortion.at<double>(1);
  const auto deviations = information.deviations();
  if (model.ownAspect) fit.aspectDeviation = deviations.tail<1>()[0];
  fit.focalDeviation_px = deviations[0];
  fit.principalDeviation_px = deviations.segment<2>(1);
  if (model.fisheye) {
    fit.camera.fisheye = true;
    fit.camera.k3 = model.distortion.at<double>(2);
    fit.camera.k4 = model.distortion.at<double>(3);
    fit.k3Deviation = deviations[5];
    fit.k4Deviation = deviations[6];
  }
  fit.k1Deviation = deviations[3];
  fit.k2Deviation = deviations[4];
  const bool tells = deviations.allFinite() &&
                     fit.focalDeviation_px <= options.largestFocalDeviation * fit.camera.focal_px &&
                     std::ranges::count_if(fit.tilt, [](double tilt) { return tilt > kFrontal; }) >= 2;
  fit.outcome = tells ? LensFit::Outcome::kDone : LensFit::Outcome::kDegenerate;
  return fit;
}

}  // namespace lens

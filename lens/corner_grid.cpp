#include "lens/corner_grid.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <utility>

namespace lens {

namespace {

constexpr double kSaddle = 0.75;     // of the neighbour's contrast; a corner on the board's border has half
constexpr double kAlike = 0.6;       // smallest ratio of the first square's four contrasts
constexpr double kLeastSaddle = 10;  // smallest contrast [levels]
constexpr float kOff = 0.3F;         // largest distance of a corner from the expected place, in squares
constexpr double kLeastSquare_px = 5.0;
constexpr int kMost = 100;  // largest number of corners in each direction from the start

using Index = std::pair<int, int>;
constexpr std::array<Index, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// Returns the mean over 3 x 3 pixels; not finite outside the picture.
double levelAt(const cv::Mat& grey, cv::Point2f place) {
  constexpr int kHalf = 1;
  if (!(std::abs(place.x) < 1e6F && std::abs(place.y) < 1e6F)) return std::nan("");
  const int u = static_cast<int>(std::lround(place.x)), v = static_cast<int>(std::lround(place.y));
  if (u < kHalf || v < kHalf || u >= grey.cols - kHalf || v >= grey.rows - kHalf) return std::nan("");
  int sum = 0;
  for (int y = v - kHalf; y <= v + kHalf; ++y) {
    for (int x = u - kHalf; x <= u + kHalf; ++x) sum += grey.at<std::uint8_t>(y, x);
  }
  return sum / 9.0;
}

/// Returns the contrast of the four squares around a corner, read a third of a square away. Its sign alternates on a
/// board.
double saddle(const cv::Mat& grey, cv::Point2f corner, cv::Point2f along, cv::Point2f across) {
  const cv::Point2f one = (along + across) / 3.0F, other = (along - across) / 3.0F;
  return 0.5 * (levelAt(grey, corner + one) + levelAt(grey, corner - one) - levelAt(grey, corner + other) -
                levelAt(grey, corner - other));
}

class Growth {
 public:
  explicit Growth(const cv::Mat& grey)
      : grey_(grey) {}

  /// Starts from one square. Returns false if it is not one.
  bool start(cv::Point2f origin, cv::Point2f right, cv::Point2f down, cv::Point2f far) {
    const std::array<std::pair<Index, cv::Point2f>, 4> square = {
        {{{0, 0}, origin}, {{1, 0}, right}, {{0, 1}, down}, {{1, 1}, far}}};
    const cv::Point2f along = 0.5F * (right - origin + far - down), across = 0.5F * (down - origin + far - right);
    if (std::min(cv::norm(along), cv::norm(across)) < kLeastSquare_px) return false;
    double least = 1e9, most = 0.0;
    for (const auto& [index, place] : square) {
      const cv::Point2f refined = refine(place, along, across);
      const double sign = (index.first + index.second) % 2 == 0 ? 1.0 : -1.0;
      const double contrast = sign * saddle(grey_, refined, along, across);
      if (!std::isfinite(contrast)) return false;
      if (index == Index{0, 0}) sign_ = contrast < 0.0 ? -1.0 : 1.0;
      least = std::min(least, sign_ * contrast);
      most = std::max(most, sign_ * contrast);
      nodes_[index] = {refined, sign_ * contrast};
    }
    return least > kLeastSaddle && least > kAlike * most;
  }

  void grow() {
    std::deque<Index> border;
    for (const auto& [index, node] : nodes_) border.push_back(index);
    while (!border.empty()) {
      const Index from = border.front();
      border.pop_front();
      for (const Index& way : kAround) {
        const Index index = {from.first + way.first, from.second + way.second};
        if (std::abs(index.first) > kMost || std::abs(index.second) > kMost || nodes_.contains(index)) continue;
        const auto node = next(from, way);
        if (!node) continue;
        nodes_[index] = *node;
        // With this corner, its neighbours may be predicted better than before.
        border.push_back(index);
        for (const Index& other : kAround) {
          const Index beside = {index.first + other.first, index.second + other.second};
          if (nodes_.contains(beside)) border.push_back(beside);
        }
      }
    }
  }

  std::size_t size() const { return nodes_.size(); }

  bool covers(cv::Point2f place) const {
    return std::ranges::any_of(nodes_,
                               [&](const auto& node) { return cv::norm(node.second.place - place) < kLeastSquare_px; });
  }

  CornerGrid rectangle() const {
    Index least = nodes_.begin()->first, most = least;
    for (const auto& [index, node] : nodes_) {
      least = {std::min(least.first, index.first), std::min(least.second, index.second)};
      most = {std::max(most.first, index.first), std::max(most.second, index.second)};
    }
    CornerGrid grid;
    grid.size = {most.first - least.first + 1, most.second - least.second + 1};
    if (static_cast<std::size_t>(grid.size.area()) != nodes_.size()) return {};
    for (int y = least.second; y <= most.second; ++y) {
      for (int x = least.first; x <= most.first; ++x) grid.places.push_back(nodes_.at({x, y}).place);
    }
    return grid;
  }

 private:
  struct Node {
    cv::Point2f place;
    double contrast = 0.0;
  };

  const Node* find(Index index) const {
    const auto found = nodes_.find(index);
    return found == nodes_.end() ? nullptr : &found->second;
  }

  cv::Point2f refine(cv::Point2f place, cv::Point2f along, cv::Point2f across) const {
    const double square = std::min(cv::norm(along), cv::norm(across));
    const int half = std::max(2, static_cast<int>(0.3 * square));
    const cv::Rect2f inside(
        cv::Point2f(static_cast<float>(half + 1), static_cast<float>(half + 1)),
        cv::Point2f(static_cast<float>(grey_.cols - half - 1), static_cast<float>(grey_.rows - half - 1)));
    if (!inside.contains(place)) {
      return place;
    }
    Places one = {place};
    cv::cornerSubPix(grey_, one, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 20, 0.01});
    return one[0];
  }

  /// Returns the side of a square at a corner, across the direction `way`, from the neighbours present.
  std::optional<cv::Point2f> crosswise(Index at, Index way) const {
    const Node* here = find(at);
    const Index side = {std::abs(way.second), std::abs(way.first)};
    const Node* after = find({at.first + side.first, at.second + side.second});
    const Node* before = find({at.first - side.first, at.second - side.second});
    if (after != nullptr && before != nullptr) return 0.5F * (after->place - before->place);
    if (after != nullptr) return after->place - here->place;
    if (before != nullptr) return here->place - before->place;
    return std::nullopt;
  }

  /// Returns the next corner in the direction `way`.
  std::optional<Node> next(Index from, Index way) const {
    const auto back = [&](int steps) {
      return find({from.first - steps * way.first, from.second - steps * way.second});
    };
    const Node& here = *find(from);
    const Node *before = back(1), *farther = back(2);
    const auto side = crosswise(from, way);
    if (before == nullptr || !side) return std::nullopt;
    cv::Point2f step = here.place - before->place;
    if (farther != nullptr) step += step - (before->place - farther->place);
    const double square = std::min(cv::norm(step), cv::norm(*side));
    if (square < kLeastSquare_px) return std::nullopt;
    const cv::Point2f expected = here.place + step, place = refine(expected, step, *side);
    if (cv::norm(place - expected) > kOff * square) return std::nullopt;
    const int x = from.first + way.first, y = from.second + way.second;
    // A backward direction changes the sign.
    const double forwards = way.first + way.second, even = (x + y) % 2 == 0 ? 1.0 : -1.0;
    const double contrast = sign_ * even * forwards * saddle(grey_, place, place - here.place, *side);
    if (!(contrast > kSaddle * here.contrast)) return std::nullopt;
    return Node{place, contrast};
  }

  cv::Mat grey_;  // shares the picture's memory
  std::map<Index, Node> nodes_;
  double sign_ = 1.0;
};

}  // namespace

CornerGrid grown(const cv::Mat& grey, const CornerGrid& found) {
  std::optional<Growth> largest;
  for (int y = 0; y + 1 < found.size.height; ++y) {
    for (int x = 0; x + 1 < found.size.width; ++x) {
      if (largest && largest->covers(found.at(x, y))) continue;
      Growth growth(grey);
      if (!growth.start(found.at(x, y), found.at(x + 1, y), found.at(x, y + 1), found.at(x + 1, y + 1))) continue;
      growth.grow();
      if (!largest || growth.size() > largest->size()) largest = std::move(growth);
    }
  }
  return largest ? largest->rectangle() : CornerGrid{};
}

}  // namespace lens

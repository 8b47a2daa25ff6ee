// The tracker beside what OpenCV offers for the same task, on the same pictures, one thread each: how far the markers
// they find are from where they were drawn, how many they find, and how long a picture takes. Prints a table.
#include "tests/unit/track/scene.h"

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

namespace tractiond::track {
namespace {

constexpr int kFrames = 48;
constexpr float kMatch_px = 2.0F;  // farther from the truth: not found

using Places = std::vector<cv::Point2f>;

/// Pictures of a gel that is pressed more and more, and where the markers are in each.
struct Film {
  Film()
      : scene({}, twin::Format::kBgr8) {
    for (int i = 0; i < kFrames; ++i) {
      Bump bump;
      bump.peak_px = {0.083 * i, 0.047 * i};
      scene.displace(bump, 0.9);
      const Frame& frame = scene.shoot();
      pictures.push_back(cv::Mat(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.data)).clone());
      frames.push_back(frame);
      frames.back().data = pictures.back().data;
      truth.push_back(scene.now);
    }
  }

  /// One layer's; blue is the first channel, red the last.
  int first(int layer) const { return layer == 0 ? 0 : scene.sensor.layers[0].count(); }
  int count(int layer) const { return scene.sensor.layers[static_cast<std::size_t>(layer)].count(); }
  static int channel(int layer) { return layer == 0 ? 0 : 2; }

  Scene scene;
  std::vector<cv::Mat> pictures;
  std::vector<Frame> frames;
  std::vector<Eigen::Matrix2Xd> truth;
};

struct Score {
  double squares = 0.0;
  long found = 0, expected = 0;
  std::vector<double> times_ms;

  void add(const Eigen::Vector2d& error) {
    squares += error.squaredNorm();
    ++found;
  }

  void print(const char* name, const char* what) {
    std::ranges::sort(times_ms);
    std::printf("%-34s %-14s %8.2f %% %10.4f px %9.3f ms\n", name, what,
                100.0 * static_cast<double>(found) / static_cast<double>(expected),
                std::sqrt(squares / (2.0 * static_cast<double>(found))), times_ms[times_ms.size() / 2]);
    std::fflush(stdout);
  }
};

template <typename Work>
double milliseconds(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

/// Each marker's nearest.
void compare(const Film& film, std::size_t frame, int layer, const Places& places, Score& score) {
  for (int i = film.first(layer); i < film.first(layer) + film.count(layer); ++i) {
    const Eigen::Vector2d truth = film.truth[frame].col(i);
    Eigen::Vector2d nearest = Eigen::Vector2d::Constant(1e9);
    for (const cv::Point2f& place : places) {
      const Eigen::Vector2d error = Eigen::Vector2d(place.x, place.y) - truth;
      if (error.squaredNorm() < nearest.squaredNorm()) nearest = error;
    }
    ++score.expected;
    if (nearest.norm() < kMatch_px) score.add(nearest);
  }
}

/// `find`: the places of one colour in its channel.
template <typename Find>
void finder(const char* name, const Film& film, Find&& find) {
  Score score;
  for (std::size_t k = 0; k < film.pictures.size(); ++k) {
    std::array<Places, 2> places;
    score.times_ms.push_back(milliseconds([&] {
      for (int layer = 0; layer < 2; ++layer) {
        cv::Mat channel;
        cv::extractChannel(film.pictures[k], channel, Film::channel(layer));
        places[static_cast<std::size_t>(layer)] = find(channel);
      }
    }));
    for (int layer = 0; layer < 2; ++layer) compare(film, k, layer, places[static_cast<std::size_t>(layer)], score);
  }
  score.print(name, "place");
}

Places blobs(const cv::Mat& channel) {
  cv::SimpleBlobDetector::Params wanted;
  wanted.blobColor = 255;
  wanted.minThreshold = 50;
  wanted.maxThreshold = 120;
  wanted.thresholdStep = 10;
  wanted.minArea = 3;
  wanted.maxArea = 60;
  wanted.minDistBetweenBlobs = 4;
  wanted.filterByCircularity = wanted.filterByConvexity = wanted.filterByInertia = false;
  std::vector<cv::KeyPoint> found;
  cv::SimpleBlobDetector::create(wanted)->detect(channel, found);
  Places places;
  cv::KeyPoint::convert(found, places);
  return places;
}

/// Outlines at half of a marker's brightness; around each the centre of mass of what is brighter than the surroundings.
Places contours(const cv::Mat& channel) {
  constexpr int kAround = 3;
  constexpr double kBackground = 28.0, kHalf = 65.0;  // levels, as the pictures are drawn
  cv::Mat mask;
  cv::threshold(channel, mask, kHalf, 255, cv::THRESH_BINARY);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  Places places;
  const cv::Rect whole(0, 0, channel.cols, channel.rows);
  for (const auto& outline : outlines) {
    cv::Rect box = cv::boundingRect(outline);
    box = cv::Rect(box.x - kAround, box.y - kAround, box.width + 2 * kAround, box.height + 2 * kAround) & whole;
    cv::Mat bright;
    cv::subtract(channel(box), kBackground, bright);
    const cv::Moments moments = cv::moments(bright);
    if (moments.m00 <= 0.0) continue;
    places.emplace_back(static_cast<float>(box.x + moments.m10 / moments.m00),
                        static_cast<float>(box.y + moments.m01 / moments.m00));
  }
  return places;
}

/// From the first picture to each: displacements.
void opticalFlow(const Film& film) {
  Score score;
  std::array<Places, 2> rest;
  for (int layer = 0; layer < 2; ++layer) {
    for (int i = film.first(layer); i < film.first(layer) + film.count(layer); ++i) {
      rest[static_cast<std::size_t>(layer)].emplace_back(static_cast<float>(film.truth[0](0, i)),
                                                         static_cast<float>(film.truth[0](1, i)));
    }
  }
  for (std::size_t k = 1; k < film.pictures.size(); ++k) {
    std::array<Places, 2> now;
    std::array<std::vector<std::uint8_t>, 2> valid;
    std::vector<float> errors;
    score.times_ms.push_back(milliseconds([&] {
      for (std::size_t layer = 0; layer < 2; ++layer) {
        cv::Mat before, after;
        cv::extractChannel(film.pictures[0], before, Film::channel(static_cast<int>(layer)));
        cv::extractChannel(film.pictures[k], after, Film::channel(static_cast<int>(layer)));
        cv::calcOpticalFlowPyrLK(before, after, rest[layer], now[layer], valid[layer], errors, {11, 11}, 2);
      }
    }));
    for (std::size_t layer = 0; layer < 2; ++layer) {
      for (std::size_t i = 0; i < now[layer].size(); ++i) {
        const int marker = film.first(static_cast<int>(layer)) + static_cast<int>(i);
        const Eigen::Vector2d error = Eigen::Vector2d(now[layer][i].x, now[layer][i].y) - film.truth[k].col(marker);
        ++score.expected;
        if (valid[layer][i] != 0 && error.norm() < kMatch_px) score.add(error);
      }
    }
  }
  score.print("pyramidal Lucas-Kanade, 11 x 11 px", "displacement");
}

void ours(Film& film) {
  Score score;
  Scene still({}, twin::Format::kBgr8);
  Tracking tracking(still);
  tracking.start(still);
  for (std::size_t k = 0; k < film.frames.size(); ++k) {
    Frame& frame = film.frames[k];
    frame.info.cameraFrameId = frame.info.frameNumber = 1000 + k;
    score.times_ms.push_back(milliseconds([&] { tracking(frame); }));
    for (int i = 0; i < film.scene.markers(); ++i) {
      ++score.expected;
      if (!tracking.field.valid[static_cast<std::size_t>(i)]) continue;
      const float* moved = &tracking.field.displacement_px[static_cast<std::size_t>(2 * i)];
      const Eigen::Vector2d error =
          Eigen::Vector2d(moved[0], moved[1]) - (film.truth[k].col(i) - film.scene.rest.col(i));
      if (error.norm() < kMatch_px) score.add(error);
    }
  }
  score.print("tractiond's tracker", "displacement");
}

}  // namespace
}  // namespace tractiond::track

int main() {
  using namespace tractiond::track;
  cv::setNumThreads(1);
  Film film;
  std::printf("%d pictures of %d markers, 640 x 480, one thread; error against the truth, time: median\n", kFrames,
              film.scene.markers());
  std::printf("%-34s %-14s %10s %13s %12s\n", "", "error of the", "found", "rms", "a picture");
  ours(film);
  finder("SimpleBlobDetector", film, blobs);
  finder("findContours, grey moments", film, contours);
  opticalFlow(film);
}

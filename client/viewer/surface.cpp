#include "client/viewer/surface.h"

#include "client/show/scene.h"
#include "sensor/elastic/matrix_cache.h"
#include "sensor/elastic/surface.h"

#include <pthread.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace traction::view {

namespace {

/// Largest number of nodes for which the matrix is computed: 288 MB, of the half space and of the block.
constexpr std::size_t kMostNodes = 2000;

/// Version of the matrices that are kept.
constexpr double kVersion = 1.0;

/// Returns the directory that keeps matrices, in the user's cache; empty: there is none.
std::filesystem::path cacheDirectory() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing here sets one
    return std::filesystem::path(value == nullptr ? "" : value);
  };
  if (const auto cache = variable("XDG_CACHE_HOME"); cache.is_absolute()) return cache / "traction";
  if (const auto home = variable("HOME"); home.is_absolute()) return home / ".cache" / "traction";
  return {};
}

/// Returns whether the gel and its nodes are plausible: a description may hold any values.
bool isPlausible(const Description& description) {
  const Gel& gel = description.gel;
  const Grid& nodes = description.nodes;
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  for (const double size : gel.size_m) {
    if (!within(size, 1e-3, 1.0)) return false;
  }
  if (nodes.columns == 0 || nodes.rows == 0 || std::size_t{nodes.columns} * nodes.rows > kMostNodes) return false;
  const double wide = nodes.pitch_m * (nodes.columns - 1), high = nodes.pitch_m * (nodes.rows - 1);
  constexpr double kClearance = 1e-3;
  return within(gel.youngsModulus_Pa, 1.0, 1e12) && within(gel.poissonRatio, 0.0, 0.49999) &&
         within(nodes.pitch_m, 1e-5, 0.1) &&
         std::abs(nodes.centre_m[0]) + 0.5 * wide + kClearance < 0.5 * gel.size_m[0] &&
         std::abs(nodes.centre_m[1]) + 0.5 * high + kClearance < 0.5 * gel.size_m[1];
}

/// Of which the matrices are.
constexpr double kModulus_Pa = 1e5;
constexpr double kMillimetres = 1e3;

/// Returns all that the matrices depend on. Young's modulus scales them: a calibrated gel has those of before.
std::vector<double> keyOf(const Description& description) {
  const Gel& gel = description.gel;
  const Grid& nodes = description.nodes;
  return {kVersion,
          gel.poissonRatio,
          gel.size_m[0],
          gel.size_m[1],
          gel.size_m[2],
          static_cast<double>(nodes.columns),
          static_cast<double>(nodes.rows),
          nodes.pitch_m,
          nodes.centre_m[0],
          nodes.centre_m[1]};
}

/// Returns the matrix of a half space [mm/N]: each distance of two nodes is computed once.
Eigen::MatrixXf halfSpaceMatrix(const Description& description) {
  const Grid& grid = description.nodes;
  const auto columns = static_cast<int>(grid.columns), rows = static_cast<int>(grid.rows), nodes = columns * rows;
  Eigen::MatrixXf apart(3 * (2 * columns - 1), 3 * (2 * rows - 1));
  for (int y = 1 - rows; y < rows; ++y) {
    for (int x = 1 - columns; x < columns; ++x) {
      apart.block<3, 3>(3 * (x + columns - 1), 3 * (y + rows - 1)) =
          (kMillimetres * sensor::elastic::halfSpaceSquare(grid.pitch_m * Eigen::Vector2d(x, y), grid.pitch_m,
                                                           kModulus_Pa, description.gel.poissonRatio))
              .cast<float>();
    }
  }
  Eigen::MatrixXf matrix(3 * nodes, 3 * nodes);
  for (int s = 0; s < nodes; ++s) {
    for (int t = 0; t < nodes; ++t) {
      matrix.block<3, 3>(3 * t, 3 * s) =
          apart.block<3, 3>(3 * (t % columns - s % columns + columns - 1), 3 * (t / columns - s / columns + rows - 1));
    }
  }
  return matrix;
}

}  // namespace

/// The matrices of a gel [mm/N], of kModulus_Pa, for all surfaces of the process that show it.
struct Surface::Work {
  struct Stopped {};

  explicit Work(Description of)
      : description(std::move(of))
      , key(keyOf(description))
      , thread([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "view-surface");
        compute(stop);
      }) {}

  /// Returns that of the process, which ends with the last surface that has it.
  static std::shared_ptr<Work> of(const Description& description) {
    static std::mutex mutex;
    static std::vector<std::weak_ptr<Work>> all;
    const std::lock_guard lock(mutex);
    std::erase_if(all, [](const auto& each) { return each.expired(); });
    for (const auto& each : all) {
      if (auto work = each.lock(); work && work->key == keyOf(description)) return work;
    }
    auto work = std::make_shared<Work>(description);
    all.push_back(work);
    return work;
  }

  void compute(const std::stop_token& stop) try {
    halfSpace = halfSpaceMatrix(description);
    share = 0.0F;  // the matrix may be read
    sensor::Gel gel;
    gel.youngsModulus = kModulus_Pa;
    gel.poissonRatio = description.gel.poissonRatio;
    gel.size = Eigen::Vector3d::Map(description.gel.size_m.data());
    const std::vector<Vector3> places = client::nodePositions_m(description);
    const Eigen::Map<const sensor::Points> nodes(places.data()->data(), 3, static_cast<Eigen::Index>(places.size()));
    const std::filesystem::path directory = cacheDirectory();
    std::optional<Eigen::MatrixXd> matrix;
    if (!directory.empty()) matrix = sensor::elastic::loadMatrix(directory, key);
    if (!matrix) {
      matrix = sensor::elastic::surfaceMatrix(gel, nodes, description.nodes.pitch_m, [&](double done) {
        if (stop.stop_requested()) throw Stopped();
        share = std::min(static_cast<float>(done), 0.99F);
      });
      if (!directory.empty()) sensor::elastic::saveMatrix(directory, key, *matrix);  // else computed again
    }
    block = (kMillimetres * *matrix).cast<float>();
    share = 1.0F;
  } catch (const Stopped&) {
  }

  const Description description;
  const std::vector<double> key;
  Eigen::MatrixXf halfSpace, block;
  std::atomic<float> share{-1.0F};  ///< of the block's that has been computed; below 0: not even the half space's
  std::jthread thread;              // last: it uses the others
};

Surface::Surface() = default;
Surface::~Surface() = default;

void Surface::describe(const Description& description) {
  modulus_Pa_ = description.gel.youngsModulus_Pa;
  if (description.body || !isPlausible(description)) return work_.reset();
  if (work_ && work_->key == keyOf(description)) return;
  work_.reset();
  work_ = Work::of(description);
}

const Eigen::VectorXf* Surface::displacement(const Field& field) {
  if (!work_) return nullptr;
  share_ = work_->share;
  if (share_ < 0.0F) return nullptr;
  const Eigen::MatrixXf& matrix = share_ < 1.0F ? work_->halfSpace : work_->block;
  if (3 * field.force_N.size() != static_cast<std::size_t>(matrix.cols())) return nullptr;
  moved_.setZero(matrix.rows());
  const auto scale = static_cast<float>(kModulus_Pa / modulus_Pa_);
  Eigen::Index column = 0;
  for (const auto& force : field.force_N) {  // nearly all are 0 in most fields
    for (const float component : force) {
      if (component != 0.0F) moved_ += scale * component * matrix.col(column);
      ++column;
    }
  }
  return &moved_;
}

}  // namespace traction::view

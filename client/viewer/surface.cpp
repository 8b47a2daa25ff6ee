#include "client/viewer/surface.h"

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

/// What the matrix depends on. Young's modulus scales it: a calibrated gel has that of before.
struct Key {
  double ratio;
  Vector3 size_m;
  std::uint32_t columns, rows;
  double pitch_m;
  Vector2 centre_m;
  bool operator==(const Key&) const = default;
};

Key keyOf(const Description& description) {
  const Grid& nodes = description.nodes;
  return {
      description.gel.poissonRatio, description.gel.size_m, nodes.columns, nodes.rows, nodes.pitch_m, nodes.centre_m};
}

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
bool isPlausible(const Key& key, double modulus_Pa) {
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  for (const double size : key.size_m) {
    if (!within(size, 1e-3, 1.0)) return false;
  }
  if (key.columns == 0 || key.rows == 0 || std::size_t{key.columns} * key.rows > kMostNodes) return false;
  const double wide = key.pitch_m * (key.columns - 1), high = key.pitch_m * (key.rows - 1);
  constexpr double kClearance = 1e-3;
  return within(modulus_Pa, 1.0, 1e12) && within(key.ratio, 0.0, 0.49999) && within(key.pitch_m, 1e-5, 0.1) &&
         std::abs(key.centre_m[0]) + 0.5 * wide + kClearance < 0.5 * key.size_m[0] &&
         std::abs(key.centre_m[1]) + 0.5 * high + kClearance < 0.5 * key.size_m[1];
}

/// Of which the matrices are.
constexpr double kModulus_Pa = 1e5;
constexpr double kMillimetres = 1e3;

/// Returns the nodes of the grid, gel frame [m].
sensor::Points pointsOf(const Key& key) {
  sensor::Points nodes(3, static_cast<Eigen::Index>(std::size_t{key.columns} * key.rows));
  const Grid grid{.columns = key.columns, .rows = key.rows, .pitch_m = key.pitch_m, .centre_m = key.centre_m};
  for (std::uint32_t row = 0, i = 0; row < key.rows; ++row) {
    for (std::uint32_t column = 0; column < key.columns; ++column, ++i) {
      const Vector2 place = grid.position_m(column, row);
      nodes.col(i) << place[0], place[1], 0.0;
    }
  }
  return nodes;
}

/// Returns the matrix of a half space [mm/N]: each distance of two nodes is computed once.
Eigen::MatrixXf halfSpaceMatrix(const Key& key) {
  const auto columns = static_cast<int>(key.columns), rows = static_cast<int>(key.rows), nodes = columns * rows;
  const int wide = 2 * columns - 1;
  std::vector<Eigen::Matrix3f> apart(static_cast<std::size_t>(wide) * (2 * key.rows - 1));
  for (int y = 1 - rows; y < rows; ++y) {
    for (int x = 1 - columns; x < columns; ++x) {
      const Eigen::Matrix3d moved =
          sensor::elastic::halfSpaceSquare(key.pitch_m * Eigen::Vector2d(x, y), key.pitch_m, kModulus_Pa, key.ratio);
      apart[static_cast<std::size_t>((y + rows - 1) * wide + x + columns - 1)] = (kMillimetres * moved).cast<float>();
    }
  }
  Eigen::MatrixXf matrix(3 * nodes, 3 * nodes);
  for (int s = 0; s < nodes; ++s) {
    for (int t = 0; t < nodes; ++t) {
      const int x = t % columns - s % columns, y = t / columns - s / columns;
      matrix.block<3, 3>(3 * t, 3 * s) = apart[static_cast<std::size_t>((y + rows - 1) * wide + x + columns - 1)];
    }
  }
  return matrix;
}

}  // namespace

/// The matrices of a gel [mm/N], of kModulus_Pa, for all surfaces of the process that show it.
struct Surface::Work {
  struct Stopped {};

  explicit Work(const Key& of)
      : key(of)
      , thread([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "view-surface");
        compute(stop);
      }) {}

  /// Returns that of the process, which ends with the last surface that has it.
  static std::shared_ptr<Work> of(const Key& key) {
    static std::mutex mutex;
    static std::vector<std::weak_ptr<Work>> all;
    const std::lock_guard lock(mutex);
    std::erase_if(all, [](const auto& each) { return each.expired(); });
    for (const auto& each : all) {
      if (auto work = each.lock(); work && work->key == key) return work;
    }
    auto work = std::make_shared<Work>(key);
    all.push_back(work);
    return work;
  }

  void compute(const std::stop_token& stop) try {
    halfSpace = halfSpaceMatrix(key);
    share.store(0.0F, std::memory_order_release);  // partner: the acquire in displacement(), which reads the matrix
    sensor::Gel gel;
    gel.youngsModulus = kModulus_Pa;
    gel.poissonRatio = key.ratio;
    gel.size = {key.size_m[0], key.size_m[1], key.size_m[2]};
    const std::vector<double> numbers = {kVersion,        key.ratio,           key.size_m[0],    key.size_m[1],
                                         key.size_m[2],   double(key.columns), double(key.rows), key.pitch_m,
                                         key.centre_m[0], key.centre_m[1]};
    const std::filesystem::path directory = cacheDirectory();
    std::optional<Eigen::MatrixXd> matrix;
    if (!directory.empty()) matrix = sensor::elastic::loadMatrix(directory, numbers);
    if (!matrix) {
      matrix = sensor::elastic::surfaceMatrix(gel, pointsOf(key), key.pitch_m, [&](double done) {
        if (stop.stop_requested()) throw Stopped();
        share.store(std::min(static_cast<float>(done), 0.99F), std::memory_order_release);
      });
      if (!directory.empty()) sensor::elastic::saveMatrix(directory, numbers, *matrix);  // else computed again
    }
    block = (kMillimetres * *matrix).cast<float>();
    share.store(1.0F, std::memory_order_release);  // partner: the acquire in displacement()
  } catch (const Stopped&) {
  }

  Key key;
  Eigen::MatrixXf halfSpace, block;
  std::atomic<float> share{-1.0F};  ///< of the block's that has been computed; below 0: not even the half space's
  std::jthread thread;              // last: it uses the others
};

Surface::Surface() = default;
Surface::~Surface() = default;

void Surface::describe(const Description& description) {
  const Key key = keyOf(description);
  modulus_Pa_ = description.gel.youngsModulus_Pa;
  if (description.body || !isPlausible(key, modulus_Pa_)) return work_.reset();
  if (work_ && work_->key == key) return;
  work_.reset();
  work_ = Work::of(key);
}

const Eigen::VectorXf* Surface::displacement(const Field& field) {
  if (!work_) return nullptr;
  share_ = work_->share.load(std::memory_order_acquire);
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

#include "client/viewer/surface.h"

#include "sensor/elastic/surface.h"

#include <pthread.h>

#include <atomic>
#include <cmath>
#include <thread>

namespace traction::view {

namespace {

/// Largest number of nodes for which the matrix is computed: 144 MB.
constexpr std::size_t kMostNodes = 2000;

struct Key {
  double modulus_Pa, ratio;
  Vector3 size_m;
  std::uint32_t columns, rows;
  double pitch_m;
  Vector2 centre_m;
  auto operator<=>(const Key&) const = default;
};

Key keyOf(const Description& description) {
  const Gel& gel = description.gel;
  const Grid& nodes = description.nodes;
  return {gel.youngsModulus_Pa, gel.poissonRatio, gel.size_m, nodes.columns, nodes.rows, nodes.pitch_m, nodes.centre_m};
}

/// Returns whether the gel and its nodes are plausible: a description may hold any values.
bool isPlausible(const Key& key) {
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  for (const double size : key.size_m) {
    if (!within(size, 1e-3, 1.0)) return false;
  }
  if (key.columns == 0 || key.rows == 0 || std::size_t{key.columns} * key.rows > kMostNodes) return false;
  const double wide = key.pitch_m * (key.columns - 1), high = key.pitch_m * (key.rows - 1);
  constexpr double kClearance = 1e-3;
  return within(key.modulus_Pa, 1.0, 1e12) && within(key.ratio, 0.0, 0.49999) && within(key.pitch_m, 1e-5, 0.1) &&
         std::abs(key.centre_m[0]) + 0.5 * wide + kClearance < 0.5 * key.size_m[0] &&
         std::abs(key.centre_m[1]) + 0.5 * high + kClearance < 0.5 * key.size_m[1];
}

}  // namespace

struct Surface::Work {
  struct Stopped {};

  explicit Work(const Key& of)
      : key(of) {}

  void compute(const std::stop_token& stop) try {
    sensor::Gel gel;
    gel.youngsModulus = key.modulus_Pa;
    gel.poissonRatio = key.ratio;
    gel.size = {key.size_m[0], key.size_m[1], key.size_m[2]};
    sensor::Points nodes(3, static_cast<Eigen::Index>(std::size_t{key.columns} * key.rows));
    const Grid grid{.columns = key.columns, .rows = key.rows, .pitch_m = key.pitch_m, .centre_m = key.centre_m};
    for (std::uint32_t row = 0, i = 0; row < key.rows; ++row) {
      for (std::uint32_t column = 0; column < key.columns; ++column, ++i) {
        const Vector2 place = grid.position_m(column, row);
        nodes.col(i) << place[0], place[1], 0.0;
      }
    }
    constexpr double kMillimetres = 1e3;
    const auto endIfStopped = [&](double) {
      if (stop.stop_requested()) throw Stopped();
    };
    const Eigen::MatrixXd matrix = sensor::elastic::surfaceMatrix(gel, nodes, key.pitch_m, {}, endIfStopped);
    matrix_mm = (kMillimetres * matrix).cast<float>();
    isReady.store(true, std::memory_order_release);  // partner: the acquire in displacement(), which reads the matrix
  } catch (const Stopped&) {
  }

  Key key;
  Eigen::MatrixXf matrix_mm;
  std::atomic<bool> isReady{false};
  std::jthread thread;  // last: it uses the others
};

Surface::Surface() = default;
Surface::~Surface() = default;

void Surface::describe(const Description& description) {
  const Key key = keyOf(description);
  if (description.body || !isPlausible(key)) return work_.reset();
  if (work_ && work_->key == key) return;
  work_ = std::make_unique<Work>(key);
  work_->thread = std::jthread([work = work_.get()](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "view-surface");
    work->compute(stop);
  });
}

const Eigen::VectorXf* Surface::displacement(const Field& field) {
  if (!work_ || !work_->isReady.load(std::memory_order_acquire)) return nullptr;
  const Eigen::MatrixXf& matrix = work_->matrix_mm;
  if (3 * field.force_N.size() != static_cast<std::size_t>(matrix.cols())) return nullptr;
  moved_.setZero(matrix.rows());
  Eigen::Index column = 0;
  for (const auto& force : field.force_N) {  // nearly all are 0 in most fields
    for (const float component : force) {
      if (component != 0.0F) moved_ += component * matrix.col(column);
      ++column;
    }
  }
  return &moved_;
}

}  // namespace traction::view

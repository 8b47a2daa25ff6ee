// Lenses and views drawn at random from what is on workbenches.
#pragma once

#include "tests/unit/lens/chessboard_camera.h"

#include <optional>
#include <vector>

namespace lens {

constexpr double kTilted[2] = {0.25, 0.8};  // least and most that a board is tilted by, to tell a lens [rad]

struct Draw {
  explicit Draw(unsigned seed)
      : generator(seed) {}

  double between(double least, double most) { return std::uniform_real_distribution<double>(least, most)(generator); }

  /// 640 to 1024 px wide, 35 to 80 degrees, some percent of barrel or pincushion.
  TrueCamera camera() {
    for (;;) {
      TrueCamera camera;
      const int sizes[][2] = {{640, 480}, {720, 540}, {800, 600}, {1024, 768}};
      const auto* size = sizes[std::uniform_int_distribution<int>(0, 3)(generator)];
      camera.width = size[0];
      camera.height = size[1];
      camera.focal = between(0.6, 1.6) * camera.width;
      camera.u0 = 0.5 * (camera.width - 1) + between(-0.03, 0.03) * camera.width;
      camera.v0 = 0.5 * (camera.height - 1) + between(-0.03, 0.03) * camera.width;
      camera.k1 = between(-0.3, 0.1);
      camera.k2 = between(-0.1, 0.1);
      const double r = 0.55 * std::hypot(camera.width, camera.height) / camera.focal, r2 = 1.2 * r * r;
      if (1.0 + (3.0 * camera.k1 + 5.0 * camera.k2 * r2) * r2 > 0.4) return camera;  // else the lens folds over
    }
  }

  Shot shot() { return {between(15, 60), between(140, 230), between(0.5, 1.1), between(0.5, 3.0)}; }

  /// The whole board with its margin in the picture, tilted by `least` to `most` [rad].
  BoardPose pose(const TrueCamera& camera, const Board& board, double least, double most) {
    const Eigen::Vector2d size(board.columns * board.square, board.rows * board.square);
    for (;;) {
      const double axis = between(-std::numbers::pi, std::numbers::pi);
      BoardPose pose;
      pose.turn = (Eigen::AngleAxisd(between(least, most), Eigen::Vector3d(std::cos(axis), std::sin(axis), 0.0)) *
                   Eigen::AngleAxisd(between(-0.5, 0.5), Eigen::Vector3d::UnitZ()))
                      .toRotationMatrix();
      const double distance = camera.focal * size.x() / (between(0.45, 0.95) * camera.width);
      const Eigen::Vector2d place = 0.4 * distance / camera.focal *
                                    Eigen::Vector2d(between(-1, 1) * camera.width, between(-1, 1) * camera.height);
      const Eigen::Vector2d middle = 0.5 * size - Eigen::Vector2d::Constant(board.square);
      pose.shift = Eigen::Vector3d(place.x(), place.y(), distance) - pose.turn.leftCols<2>() * middle;
      if (isInPicture(camera, board, pose)) return pose;
    }
  }

  std::mt19937 generator;

 private:
  static bool isInPicture(const TrueCamera& camera, const Board& board, const BoardPose& pose) {
    constexpr double kMargin = 0.5;  // squares
    for (const double x : {-1.0 - kMargin, 0.5 * board.columns, board.columns - 1.0 + kMargin}) {
      for (const double y : {-1.0 - kMargin, 0.5 * board.rows, board.rows - 1.0 + kMargin}) {
        const Eigen::Vector3d point = pose.turn * Eigen::Vector3d(board.square * x, board.square * y, 0.0) + pose.shift;
        const Eigen::Vector2d place = camera.project(point);
        if (!(place.x() > 3 && place.y() > 3 && place.x() < camera.width - 4 && place.y() < camera.height - 4)) {
          return false;
        }
        // A lens folds what is far outside back into the picture.
        if ((camera.ray(place.x(), place.y()) - point.hnormalized()).norm() > 1e-6) return false;
      }
    }
    return true;
  }
};

}  // namespace lens

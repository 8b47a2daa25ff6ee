// TUIO 1.1 (2Dcur) and 2.0 (ptr) over OSC: touches for multi-touch programs. www.tuio.org
#pragma once

#include "client/input/osc.h"
#include "client/input/touches.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace traction::input {

struct TuioOptions {
  std::string address = "127.0.0.1:3333";
  double fullPress_N = 10.0;  ///< press that TUIO 2.0 calls 1
};

/// The rectangle about the origin that a program's window or screen is mapped to.
struct Area {
  std::array<double, 2> size_m = {0.072, 0.072};

  /// Returns a place as fractions from the upper left corner, at most its edge.
  std::array<double, 2> fractions(const std::array<double, 2>& position_m) const;
};

/// How a touch moves, in sizes of the area, and how its press changes, in full presses; changes are those of the last
/// 50 ms.
struct Motion {
  std::int64_t time_ns = 0;
  std::array<double, 2> velocity{};  ///< to the right and down [1/s]
  double acceleration = 0.0;         ///< of the speed [1/s^2]
  double press = 0.0;                ///< 0 to 1
  double pressSpeed = 0.0;           ///< [1/s]
  double pressAcceleration = 0.0;    ///< [1/s^2]
};
using Motions = std::map<std::uint64_t, Motion>;  ///< by the touch's id

/// Returns how touches move.
/// \param before what it returned for the field before
Motions motionsOf(const Touches& touches, const Motions& before, const Area& area, double fullPress_N);

/// Returns the messages of a bundle of TUIO 1.1.
/// \param motions of all touches
/// \param frame number of the bundle, from 1; -1: it repeats what was told, and receivers do not ask whether it is late
std::vector<OscMessage> tuio11(const Touches& touches, const Motions& motions, const Area& area, std::int32_t frame);
/// Returns the messages of a bundle of TUIO 2.0. The parameters are those of tuio11(), but each frame has a number.
/// \param real_ns time of the frame [ns since 1970]
std::vector<OscMessage> tuio20(const Touches& touches, const Motions& motions, const Area& area, std::int32_t frame,
                               std::int64_t real_ns);

/// Sends a bundle for each field while something touches the gel, one after it, and one each second from then on: the
/// receiver takes a touch for lifted when a bundle does not list it, and datagrams may be lost.
class TuioOutput : public Output {
 public:
  enum class Version : std::uint8_t { k11, k20 };

  TuioOutput(Datagrams datagrams, Version version, const Area& area, double fullPress_N);

  void write(const Touches& touches) override;
  void turn(std::int64_t now_ns) override;

 private:
  void send(const Touches& touches, std::int32_t frame) const;

  Datagrams datagrams_;
  Version version_;
  Area area_;
  double fullPress_N_;
  Motions motions_;
  std::int32_t frame_;  ///< number of the last bundle
  bool isTouched_ = false;
  std::int64_t told_ns_ = 0;  ///< turn() after which it was last told what touches
};

}  // namespace traction::input

// What touches the gel as its user sees it, and what outputs are.
#pragma once

#include "touch/contact_tracker.h"
#include "traction/description.h"
#include "traction/messages.h"

#include <array>
#include <cstdint>
#include <vector>

namespace traction::input {

using Wrench = std::array<double, 6>;  ///< force [N] and moment [N m], each (x, y, z)

// All is in the user's frame: its origin is that of the gel frame, x points to the right, y away from the user (up on a
// screen), z out of the gel. The gel frame is that of the camera, which sees the gel from behind.

/// A contact from its begin to its end.
struct Touch {
  std::uint64_t id = 0;
  /// False: it is not in this field, and may come back; the rest is as last seen.
  bool seen = false;
  std::array<double, 2> position_m{};
  std::array<double, 2> velocity_m_s{};
  std::array<double, 2> shear_N{};  ///< on the gel
  double press_N = 0.0;             ///< into the gel
  double torque_Nm = 0.0;           ///< about z, on the gel
  double radius_m = 0.0;
  std::array<double, 2> halfAxes_m{};  ///< the larger one first
  double orientation_rad = 0.0;        ///< of the larger one, from x towards y, in [-pi/2, pi/2)
};

/// How the shear of the whole field changes with the place: what an affine map of places to tractions says, fitted to
/// the nodes that are pressed, but for its turn, which is a torque.
struct Gradient {
  double dilation_Pa_m = 0.0;   ///< growth of x along x, and of y along y: above 0, the gel is spread
  double stretch_Pa_m = 0.0;    ///< growth of x along x less that of y along y
  double shear_Pa_m = 0.0;      ///< growth of x along y, and of y along x
  double deviation_Pa_m = 0.0;  ///< of each, that noise alone causes; an upper bound
};

struct Touches {
  std::int64_t time_ns = 0;    ///< of capture; increases
  bool valid = false;          ///< false: nothing is known of this moment
  std::vector<Touch> touches;  ///< that have begun and not ended, by increasing id
  Wrench wrench{};             ///< on the whole gel, about the origin; 0 without touches, as last seen where not valid
  Gradient gradient{};         ///< of the whole gel; 0 without touches, as last seen where not valid
};

/// Returns the time from one field to the next [s], at most 0.1 s: where fields were lost, forces are not known, and
/// what moves at a speed should not jump.
double stepOf(std::int64_t before_ns, std::int64_t now_ns);

/// Turns contacts into the user's frame. Thread-bound.
class View {
 public:
  /// \param turn_rad angle from the user's y to the gel's, counter-clockwise for the user
  explicit View(double turn_rad)
      : turn_rad_(turn_rad) {}

  /// Returns what touches the gel, valid until the next call.
  /// \param contacts by ContactTracker::update() of this field
  /// \param field that the contacts are of; null: none came
  /// \param nodes of the field; null: they are not known, and the gradient is 0
  const Touches& take(const std::vector<touch::Contact>& contacts, const Field* field, std::int64_t time_ns,
                      const Grid* nodes = nullptr);

 private:
  Gradient gradientOf(const Field& field, const Grid& nodes) const;
  Touch turned(const touch::Contact& contact) const;

  double turn_rad_;
  Touches touches_;
};

/// Time after which datagrams that tell of an end are sent again, as they may have been lost [ns].
inline constexpr std::int64_t kRepeat_ns = 1'000'000'000;

/// Writes what touches the gel in the form that other programs read. Thread-bound.
class Output {
 public:
  virtual ~Output() = default;

  /// Writes the touches of one field. Called for each field in order. A touch that is no longer listed was lifted or,
  /// if the field is not valid, lost.
  virtual void write(const Touches& touches) = 0;
  /// Does work that is due without a field. Called at least ten times a second.
  /// \param now_ns of a clock that is not set; increases
  virtual void turn(std::int64_t now_ns) { static_cast<void>(now_ns); }
};

}  // namespace traction::input

// What happens to the twin: its gel and camera, and who presses where and when.
#pragma once

#include "sensor/sensor.h"
#include "sensor/toml_table.h"
#include "twin/creep.h"
#include "twin/format.h"
#include "twin/optics.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace twin {

/// What a contact does at one moment; force and torque of the object on the gel, gel frame.
struct ContactState {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< of its centre [m]
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< [N], pressing: +z
  double torque = 0.0;                                 ///< [N m] about +z: turns x towards y

  bool operator==(const ContactState&) const = default;
  bool isLoaded() const { return torque != 0.0 || !force.isZero(0.0); }
};

/// A round patch of constant size. Its force is spread as `shape` says in all three directions, its torque as the
/// tangential traction r sqrt(1 - r^2 / radius^2).
struct Contact {
  enum class Shape { kHertz, kDisc };  ///< sqrt(1 - r^2 / radius^2); constant

  Shape shape = Shape::kHertz;
  double radius = 0.0;        ///< [m]
  std::vector<double> times;  ///< [s], ascending
  std::vector<ContactState> states;

  /// Linear between the key times, constant before and after.
  ContactState at(double time_s) const;
};

/// Markers that cannot be seen for a while.
struct Absence {
  std::vector<int> markers;
  double from_s, to_s;
};

/// The lens out of focus for a while.
struct Defocus {
  double blur_px;
  double from_s, to_s;
};

/// Pictures that do not hang together: the rows from `row` down are of an earlier moment, or moved aside.
struct Tear {
  int row = 240;
  double lag_s = 0.0;  ///< by how much they are older
  int shift_px = 0;    ///< to the right; what leaves the picture comes in on the left
  double from_s = 0.0, to_s = 0.0;
};

/// The gel and its mount become warmer and cooler.
struct Warmth {
  std::vector<double> times = {0.0};  ///< [s], ascending
  std::vector<double> rise = {0.0};   ///< of the temperature above the first zero's [K]
  double expansion = 3e-4;            ///< of the gel: silicone's [1/K]; it grows from the centre of its base
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  ///< of the picture, right and down [px/K]
  double scale = 0.0;                                  ///< of the picture about the principal point [1/K]
  double roll = 0.0;                                   ///< about it, u towards v [rad/K]

  /// Linear between the key times, constant before and after [K].
  double at(double time_s) const;
};

struct Scenario {
  sensor::Sensor sensor;
  Format format = Format::kRgb8;
  double rate_hz = 60.0;
  Optics optics;
  double period_s = 1.0;  ///< then all begins again
  std::vector<Contact> contacts;
  std::vector<CreepTerm> creep;
  Warmth warmth;
  std::vector<Absence> absences;
  std::vector<Defocus> defocuses;
  std::vector<Tear> tears;
};

/// Force and moment about the origin (gel frame) of all contacts at one moment.
struct Resultant {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< [N m]

  void add(const ContactState& contact);
};

tl::expected<Scenario, sensor::FileError> parseScenario(std::string_view text, const std::string& name);
tl::expected<Scenario, sensor::FileError> loadScenario(const std::string& path);

}  // namespace twin

// A scenario: the twin's gel and camera, and the contacts over time.
#pragma once

#include "base/toml_table.h"
#include "sensor/sensor.h"
#include "twin/format.h"
#include "twin/hand.h"
#include "twin/optics.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twin {

/// State of a contact at one time. Force and torque are those of the object on the gel, gel frame; of a body, along the
/// normal and across it (BodyModel::load).
struct ContactState {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< centre of the patch, gel frame [m]
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< [N], pressing: +z
  double torque = 0.0;                                 ///< [N m] about +z; positive turns x towards y

  bool operator==(const ContactState&) const = default;
  /// Returns whether force or torque is not 0.
  bool isLoaded() const { return torque != 0.0 || !force.isZero(0.0); }
};

/// A round patch of constant size. `shape` is the distribution of the force in all three directions. The torque is
/// applied as tangential traction proportional to r sqrt(1 - r^2 / radius^2).
struct Contact {
  enum class Shape { kHertz, kDisc };  ///< proportional to sqrt(1 - r^2 / radius^2); constant

  Shape shape = Shape::kHertz;
  double radius = 0.0;        ///< [m]
  std::vector<double> times;  ///< [s], ascending
  /// One per time.
  std::vector<ContactState> states;

  /// Returns the state at a time [s]: linear between the times, constant before and after; the state of an
  /// unloaded contact if there are no times.
  ContactState at(double time_s) const;
};

/// Markers that are invisible for some time.
struct Absence {
  std::vector<int> markers;  ///< indices, in the order of sensor::markerPositions
  double from_s, to_s;       ///< scenario times; `to_s` is excluded
};

/// Temperature of the gel and its mount over time.
struct Warmth {
  std::vector<double> times = {0.0};  ///< [s], ascending
  std::vector<double> rise = {0.0};   ///< temperature above that of the first zero [K]
  double expansion = 3e-4;  ///< thermal expansion of the gel (silicone) [1/K]; it grows from the centre of its base
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  ///< shift of the picture, right and down [px/K]
  double scale = 0.0;                                  ///< change of the picture's size about the principal point [1/K]
  double roll = 0.0;  ///< of the picture about the principal point, u towards v [rad/K]

  /// Returns the rise at a time [K]: linear between the times, constant before and after.
  double at(double time_s) const;
};

struct Scenario {
  sensor::Sensor sensor;
  Format format = Format::kRgb8;  ///< of the stream, until a client chooses another one
  double rate_hz = 60.0;          ///< as `format`
  Optics optics;
  double period_s = 1.0;  ///< the scenario repeats after this time
  std::vector<Contact> contacts;
  std::vector<sensor::CreepTerm> creep;  ///< of which shares and times count
  Warmth warmth;
  std::vector<Absence> absences;
  /// A gripper; `contacts` are then the pressures of RoundContact::radii() on one finger, at the ends of their reach.
  std::optional<HandOptions> hand;
};

/// Force and moment of all contacts at one time, about the origin of the gel frame.
struct Resultant {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< [N m]

  void add(const ContactState& contact);  ///< Adds force and moment of a contact on a block, torque included.
};

// These read a scenario in TOML, a file of at most 4 MiB, and its gel file, if it names one. They fail for wrong
// syntax, an unknown key, a wrong type and an impossible value; the error has `unreadable` if a file is larger or
// cannot be read. \param name names the file in errors; the gel file counts from its folder \param gel path of a gel
// file in place of the scenario's gel; empty: none
tl::expected<Scenario, tractiond::FileError> parseScenario(std::string_view text, const std::string& name,
                                                           const std::string& gel = {});
tl::expected<Scenario, tractiond::FileError> loadScenario(const std::string& path, const std::string& gel = {});

}  // namespace twin

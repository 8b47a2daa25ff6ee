// A box that does not exist, of which each thing is drawn good or bad.
#pragma once

#include "tests/unit/client/doctor_box.h"

#include <functional>
#include <random>
#include <set>

namespace traction::doctor {

inline const std::string kDaemon = "/opt/bin/tractiond";

/// A box with one instance or two, of which each thing is drawn good or bad.
class DrawnBox {
 public:
  explicit DrawnBox(unsigned seed);

  FakeBox box;
  std::set<std::string> bad;                 ///< checks
  std::set<std::string> unknown;             ///< of checks
  std::vector<std::function<void()>> cures;  ///< after all of them nothing is bad

 private:
  bool coin() { return one(2) == 0; }
  unsigned one(unsigned of) { return std::uniform_int_distribution<unsigned>(0, of - 1)(random_); }
  template <typename Any>
  Any any(std::initializer_list<Any> all) {
    return *(all.begin() + one(static_cast<unsigned>(all.size())));
  }
  /// Good or bad; of the bad it is noted how it is mended.
  void draw(const std::string& check, const std::function<void()>& good, const std::function<void()>& wrong) {
    if (coin()) return good();
    bad.insert(check);
    wrong();
    cures.push_back(good);
  }

  void drawMachine();
  void drawUsb();
  void drawUsers();
  void drawKeys();
  void drawOthers();
  void configure(const std::string& name, const std::string& camera);
  void drawInstance();
  void drawService();
  void limit();
  void answerUnit();
  /// What is asked for is allowed by a limit or a capability, or is refused in one way or several.
  void drawRealTime();
  void drawState();
  void drawPorts();
  void drawNetwork();
  void drawMeasurement();

  std::mt19937 random_;
  bool onNetwork_ = false, hasUser_ = true;
  std::string name_, camera_, packetSocket_;
  std::string realTime_, unit_, files_, memory_, locked_ = "65536";
  int mostPriority_ = 0;
  bool restricted_ = true;
  int buffer_ = 0, packet_ = 0, port_ = 0;
};

}  // namespace traction::doctor

// Touches in, events of the kernel's input devices out, read as a program reads them.
#include "client/input/devices.h"
#include "tests/unit/input/touches.h"

#include <gtest/gtest.h>
#include <linux/input.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace traction::input::test {
namespace {

/// The other end of a device: its state as the kernel keeps it, by multitouch protocol B.
class Reader {
 public:
  Reader() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe(ends.data()), 0);
    in_ = ends[0];
    out_ = ends[1];
  }
  ~Reader() { close(in_); }

  /// Must be called once.
  EventDevice device() const { return EventDevice(out_); }

  /// Reads the events that wait. Returns the number of reports.
  int read() {
    std::array<input_event, 256> events{};
    const ssize_t size = ::read(in_, events.data(), sizeof events);
    int reports = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(size) / sizeof events[0]; ++i) {
      const input_event& event = events[i];
      if (event.type == EV_SYN) ++reports;
      if (event.type == EV_KEY) keys[event.code] = event.value;
      if (event.type == EV_REL) moved[event.code] += event.value;
      if (event.type != EV_ABS) continue;
      if (event.code == ABS_MT_SLOT) {
        slot_ = event.value;
      } else if (event.code == ABS_MT_TRACKING_ID && event.value < 0) {
        EXPECT_EQ(slots.erase(slot_), 1U) << "a slot is lifted that is free";
      } else if (event.code > ABS_MT_SLOT) {
        slots[slot_][event.code] = event.value;
      } else {
        axes[event.code] = event.value;
      }
    }
    return reports;
  }

  std::map<int, int> keys, axes, moved;
  std::map<int, std::map<int, int>> slots;

 private:
  int in_ = -1, out_ = -1;
  int slot_ = 0;
};

constexpr double kGram_N = 9.80665e-3;

TEST(TouchDevice, HasASlotForEachTouchWithItsPressInGramsUntilAllAreLifted) {
  Reader reader;
  TouchDevice device(reader.device(), {}, {});
  Touch leans = touchOf(7, 0.0, 0.0, 250 * kGram_N);
  leans.orientation_rad = std::numbers::pi / 3;  // 30 degrees clockwise from away
  device.write(fieldOf({leans, touchOf(9, 0.01, -0.02, 1.0)}));
  EXPECT_EQ(reader.read(), 1);
  ASSERT_EQ(reader.slots.size(), 2U);
  EXPECT_EQ(reader.slots[0], (std::map<int, int>{{ABS_MT_TRACKING_ID, 7},
                                                 {ABS_MT_POSITION_X, 3600},
                                                 {ABS_MT_POSITION_Y, 3600},
                                                 {ABS_MT_PRESSURE, 250},
                                                 {ABS_MT_TOUCH_MAJOR, 1000},
                                                 {ABS_MT_TOUCH_MINOR, 600},
                                                 {ABS_MT_ORIENTATION, 30}}));
  EXPECT_EQ(reader.slots[1][ABS_MT_POSITION_X], 4600);
  EXPECT_EQ(reader.slots[1][ABS_MT_POSITION_Y], 5600);
  EXPECT_EQ(reader.keys[BTN_TOUCH], 1);
  EXPECT_EQ(reader.axes[ABS_X], 3600);
  device.write(fieldOf({touchOf(9, 0.01, 0.0), touchOf(11, 0.0, 0.0)}));
  reader.read();
  EXPECT_EQ(reader.slots[0][ABS_MT_TRACKING_ID], 11);
  EXPECT_EQ(reader.slots[1][ABS_MT_TRACKING_ID], 9);
  device.write(Touches{});
  reader.read();
  EXPECT_TRUE(reader.slots.empty());
  EXPECT_EQ(reader.keys[BTN_TOUCH], 0);
}

TEST(PenDevice, HasPressureAndLeansAgainstTheShearUntilItIsLifted) {
  Reader reader;
  PenDevice device(reader.device(), {}, {.fullPress_N = 4.0});
  Touch pen = touchOf(1, -0.036, 0.036, 2.0);
  pen.shear_N = {-2.0, -2.0 * std::tan(0.5)};  // it pushes to the left and towards the user
  device.write(fieldOf({pen, touchOf(2, 0.0, 0.0)}));
  EXPECT_EQ(reader.read(), 1);
  EXPECT_EQ(reader.axes,
            (std::map<int, int>{{ABS_X, 0}, {ABS_Y, 0}, {ABS_PRESSURE, 2048}, {ABS_TILT_X, 45}, {ABS_TILT_Y, -29}}));
  EXPECT_EQ(reader.keys, (std::map<int, int>{{BTN_TOOL_PEN, 1}, {BTN_TOUCH, 1}}));
  device.write(Touches{});
  reader.read();
  EXPECT_EQ(reader.axes[ABS_PRESSURE], 0);
  EXPECT_EQ(reader.keys, (std::map<int, int>{{BTN_TOOL_PEN, 0}, {BTN_TOUCH, 0}}));
}

TEST(OneOrSeveral, TwoFingersThatComeOneAfterTheOtherClickNothing) {
  Reader mouse, screen;
  OneOrSeveral both(PointerDevice(mouse.device(), {}), TouchDevice(screen.device(), {}, {}));
  both.write(fieldOf({touchOf(1, 0.0, 0.0, 2.0)}));
  both.write(fieldOf({touchOf(1, 0.0, 0.0, 2.0), touchOf(2, 0.01, 0.0, 2.0)}, 2 * kFrame_ns));
  screen.read();
  EXPECT_EQ(screen.slots.size(), 2U);
  both.write(fieldOf({touchOf(3, 0.0, 0.0, 5.0)}, 3 * kFrame_ns));
  both.write(fieldOf({}, 4 * kFrame_ns));
  both.write(fieldOf({touchOf(4, 0.0, 0.0, 5.0)}, 5 * kFrame_ns));  // which makes an event to be read
  mouse.read();
  EXPECT_EQ(mouse.keys, (std::map<int, int>{{BTN_RIGHT, 1}}));
}

TEST(OneOrSeveral, GivesEachContactToOneDevice) {
  Reader mouse, screen;
  OneOrSeveral both(PointerDevice(mouse.device(), {}), TouchDevice(screen.device(), {}, {}));
  std::int64_t time_ns = 0;
  const auto write = [&](const std::vector<Touch>& touches) { both.write(fieldOf(touches, time_ns += kFrame_ns)); };
  Touch finger = touchOf(1, 0.0, 0.0, 2.0);
  finger.shear_N = {1.0, 0.0};
  for (int frame = 0; frame < 10; ++frame) write({finger});
  mouse.read();
  EXPECT_EQ(mouse.keys[BTN_LEFT], 1);
  EXPECT_GT(mouse.moved[REL_X], 40);
  write({finger, touchOf(2, 0.01, 0.0)});
  mouse.read();
  screen.read();
  EXPECT_EQ(mouse.keys[BTN_LEFT], 0);
  EXPECT_EQ(screen.slots.size(), 2U);
  const int before = mouse.moved[REL_X];
  write({finger});  // what is left of several is a touch until it is lifted
  write({});
  screen.read();
  EXPECT_TRUE(screen.slots.empty());
  write({finger});
  write({finger});
  mouse.read();
  EXPECT_EQ(mouse.keys[BTN_LEFT], 0);
  EXPECT_EQ(mouse.moved[REL_X], before + 5);  // (1 - 0.2) N x 400 counts / N s / 60 Hz
}

}  // namespace
}  // namespace traction::input::test

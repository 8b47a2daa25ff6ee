// Strokes in, keys out, read as a program reads them.
#include "client/input/keyboard.h"
#include "client/input/teacher.h"
#include "tests/support/places.h"
#include "tests/unit/input/touches.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/input.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

namespace traction::input::test {
namespace {

class KeyboardTest : public testing::Test {
 protected:
  ~KeyboardTest() override { close(ends_[0]); }

  /// Draws a symbol of the alphabet, 20 mm high, without lifting the touch.
  void draw(std::uint64_t id, const std::string& symbol, const std::string& mode = "letters") {
    for (const Template& each : alphabet_) {
      if (each.symbol != symbol || each.mode != mode) continue;
      for (const auto& [x, y] : each.stroke)
        keyboard_.write(fieldOf({touchOf(id, 2e-4 * x, 2e-4 * y)}, time_ns_ += kFrame_ns));
      return;
    }
    FAIL() << "no stroke for " << symbol;
  }
  /// Presses in one place, without lifting the touch.
  /// \param torque_Nm at a time [s]
  void press(
      std::uint64_t id, double seconds, double press_N,
      const std::function<double(double)>& torque_Nm = [](double) { return 0.0; }) {
    for (int frame = 0; frame < 60.0 * seconds; ++frame) {
      Touch touch = touchOf(id, 0.0, 0.0, press_N);
      touch.torque_Nm = torque_Nm(frame / 60.0);
      keyboard_.write(fieldOf({touch}, time_ns_ += kFrame_ns));
    }
  }
  void lift() { keyboard_.write(fieldOf({}, time_ns_ += kFrame_ns)); }

  /// Returns the keys that went down, each of which must be up again.
  std::vector<int> typed() {
    std::array<input_event, 64> events{};
    const ssize_t size = read(ends_[0], events.data(), sizeof events);
    std::vector<int> down;
    int held = 0;
    for (ssize_t i = 0; i < size / static_cast<ssize_t>(sizeof events[0]); ++i) {
      const input_event& event = events[static_cast<std::size_t>(i)];
      if (event.type != EV_KEY) continue;
      if (event.value == 1) down.push_back(event.code);
      held += event.value == 1 ? 1 : -1;
    }
    EXPECT_EQ(held, 0);
    return down;
  }

 private:
  static std::array<int, 2> pipeEnds() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_NONBLOCK), 0);
    return ends;
  }
  const std::array<int, 2> ends_ = pipeEnds();

 protected:
  const Alphabet alphabet_ = loadAlphabet(tractiond::test::source("config/input/strokes/alphabet.toml")).value();
  Keyboard keyboard_{EventDevice(ends_[1]), alphabet_, {}};
  std::int64_t time_ns_ = 0;
};

TEST_F(KeyboardTest, EachSymbolThatIsShippedTypesItsKey) {
  EXPECT_TRUE(std::all_of(alphabet_.begin(), alphabet_.end(),
                          [](const Template& each) { return Keyboard::canType(each.symbol); }));
  draw(1, "t");
  EXPECT_EQ(typed(), std::vector<int>{}) << "before it is lifted";
  lift();
  EXPECT_EQ(typed(), std::vector<int>{KEY_T});
  for (const char* symbol : {"z", "space", "delete"}) draw(2, symbol), lift();
  EXPECT_EQ(typed(), (std::vector<int>{KEY_Z, KEY_SPACE, KEY_BACKSPACE}));
  draw(3, "digits");
  lift();
  draw(4, "7", "digits");
  lift();
  EXPECT_EQ(typed(), std::vector<int>{KEY_7});
}

TEST_F(KeyboardTest, TapsAndHardPressesTypeTheirKeysWhereTheyAreLifted) {
  press(1, 0.2, 2.0);
  EXPECT_EQ(typed(), std::vector<int>{}) << "before it is lifted";
  lift();
  EXPECT_EQ(typed(), std::vector<int>{KEY_SPACE});
  press(2, 0.2, 5.0);
  lift();
  EXPECT_EQ(typed(), std::vector<int>{KEY_ENTER});
  press(3, 0.2, 0.3), lift();  // hardly touched
  press(4, 1.0, 5.0), lift();  // rests
  press(5, 0.2, 2.0);
  keyboard_.write(Touches{});  // lost
  lift();
  EXPECT_EQ(typed(), std::vector<int>{});
}

TEST_F(KeyboardTest, EachTurnTypesOnceWhateverTheTremor) {
  press(1, 1.0, 2.0, [](double time_s) { return 6e-3 * time_s + 1e-3 * std::sin(60.0 * time_s); });
  EXPECT_EQ(typed(), std::vector<int>{KEY_LEFT}) << "while it touches";
  press(1, 1.0, 2.0, [](double time_s) { return 6e-3 - 12e-3 * time_s; });
  EXPECT_EQ(typed(), std::vector<int>{KEY_RIGHT});
  lift();
  EXPECT_EQ(typed(), std::vector<int>{}) << "neither a tap nor a stroke";
  press(2, 0.2, 2.0, [](double) { return 8e-3; });
  draw(2, "z");
  lift();
  EXPECT_EQ(typed(), std::vector<int>{KEY_LEFT}) << "what was a turn is no stroke";
  draw(3, "z");
  press(3, 0.2, 2.0, [](double) { return 8e-3; });
  draw(3, "z");
  lift();
  EXPECT_EQ(typed().size(), 1U) << "what was a stroke is no turn";
}

TEST_F(KeyboardTest, SeveralTouchesAndALostSensorTypeNothing) {
  draw(2, "z");
  keyboard_.write(fieldOf({touchOf(2, 0.0, 0.0), touchOf(3, 0.01, 0.0)}));
  keyboard_.write(fieldOf({touchOf(2, 0.0, 0.0)}));
  lift();
  draw(4, "z");
  keyboard_.write(Touches{});
  lift();
  EXPECT_EQ(typed(), std::vector<int>{});
  EXPECT_FALSE(Keyboard::canType("é"));
}

TEST(Teacher, PrintsStrokesThatAnAlphabetTakes) {
  std::ostringstream out;
  Teacher teacher("w", false, out);
  for (const int x : {0, 1, 2, 3, 4}) teacher.write(fieldOf({touchOf(1, 1e-3 * x, x % 2 == 0 ? 4e-3 : 0.0)}));
  teacher.write(fieldOf({}));
  teacher.write(fieldOf({touchOf(2, 0.0, 0.0)}));
  teacher.write(fieldOf({}));
  const auto taught = parseAlphabet(out.str(), "taught");
  ASSERT_TRUE(taught) << taught.error().message();
  ASSERT_EQ(taught->size(), 1U) << "a tap is no stroke";
  EXPECT_EQ(taught->front().symbol, "w");
  EXPECT_EQ(taught->front().mode, kLetters);
  EXPECT_EQ(taught->front().stroke, (Stroke{{0, 4}, {1, 0}, {2, 4}, {3, 0}, {4, 4}}));
}

}  // namespace
}  // namespace traction::input::test

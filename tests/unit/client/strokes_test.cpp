// Strokes of a contact as letters.
#include "client/input/strokes/stroke_reader.h"
#include "tests/support/handwriting.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace traction::input {
namespace {

using Kind = Reading::Kind;

const Alphabet& shipped() {
  static const Alphabet alphabet = loadAlphabet(ALPHABET).value();
  return alphabet;
}

const Stroke& strokeOf(const std::string& symbol, std::string_view mode = kLetters) {
  const auto found =
      std::ranges::find_if(shipped(), [&](const Template& each) { return each.symbol == symbol && each.mode == mode; });
  return found->stroke;
}

Reading readingOf(StrokeReader& reader, const Stroke& stroke) {
  for (const auto& place : stroke) reader.move(place);
  return reader.end().value();
}

TEST(Alphabet, HasLettersDigitsSpaceAndDelete) {
  std::set<std::string> letters, digits;
  for (const Template& each : shipped()) (each.mode == kLetters ? letters : digits).insert(each.symbol);
  for (char letter = 'a'; letter <= 'z'; ++letter) EXPECT_TRUE(letters.contains(std::string(1, letter))) << letter;
  for (char digit = '0'; digit <= '9'; ++digit) EXPECT_TRUE(digits.contains(std::string(1, digit))) << digit;
  for (const std::string both : {"space", "delete"}) EXPECT_TRUE(letters.contains(both) && digits.contains(both));
  EXPECT_TRUE(letters.contains(std::string(kDigits)) && digits.contains(std::string(kLetters)));
}

TEST(Alphabet, RefusesWhatIsNoStroke) {
  for (const char* text :
       {"", "[[stroke]]\npoints = [0, 0, 1, 1]\n", "[[stroke]]\nsymbol = \"a\"\npoints = [0, 0, 1]\n",
        "[[stroke]]\nsymbol = \"a\"\nmode = \"runes\"\npoints = [0, 0, 1, 1]\n",
        "[[stroke]]\nsymbol = \"a\"\npoint = [0, 0, 1, 1]\n"}) {
    const auto alphabet = parseAlphabet(text, "bad.toml");
    ASSERT_FALSE(alphabet) << text;
    EXPECT_EQ(alphabet.error().exitCode, 78) << text;
  }
}

TEST(StrokeReader, ReadsWhatWritersDraw) {
  std::mt19937_64 generator(tractiond::test::seed());
  const StrokeReader reader(shipped());
  int all = 0, right = 0, wrong = 0;
  for (int number = 0; number < 5; ++number) {
    test::Writer writer(generator, 0.05);
    for (const Template& each : shipped()) {
      if (each.mode != kLetters) continue;
      StrokeReader one = reader;
      const Reading reading = readingOf(one, writer.draw(each.symbol, each.stroke));
      const bool isRight = reading.symbol == each.symbol && reading.kind != Kind::kDoubtful;
      ++all;
      right += isRight;
      wrong += !isRight && reading.kind != Kind::kDoubtful;
    }
  }
  EXPECT_GE(right, all * 93 / 100);
  EXPECT_LE(wrong, all * 5 / 100);
}

TEST(StrokeReader, ReadsAStrokeOfAnySizePlaceAndDirection) {
  StrokeReader reader(shipped());
  Stroke stroke = strokeOf("r");
  for (auto& [x, y] : stroke) {
    x = 0.07 * x - 30.0;
    y = 0.07 * y + 11.0;
  }
  EXPECT_EQ(readingOf(reader, stroke).symbol, "r");
  std::ranges::reverse(stroke);
  EXPECT_EQ(readingOf(reader, stroke).symbol, "r");
}

TEST(StrokeReader, ReadsDigitsInAModeOfTheirOwn) {
  StrokeReader reader(shipped());
  EXPECT_EQ(readingOf(reader, strokeOf("i")).symbol, "i");
  EXPECT_EQ(readingOf(reader, strokeOf("digits")).kind, Kind::kMode);
  EXPECT_EQ(readingOf(reader, strokeOf("i")).symbol, "1");
  EXPECT_EQ(readingOf(reader, strokeOf("letters", kDigits)).kind, Kind::kMode);
  EXPECT_EQ(readingOf(reader, strokeOf("i")).symbol, "i");
}

TEST(StrokeReader, WritesNothingOfATapOrADoubtfulStroke) {
  StrokeReader reader(shipped());
  EXPECT_FALSE(reader.end());
  EXPECT_EQ(readingOf(reader, {{1.0, 1.0}}).kind, Kind::kTap);
  EXPECT_EQ(readingOf(reader, {{1.0, 1.0}, {1.5, 2.0}}).kind, Kind::kTap);
  Stroke between = strokeOf("u");  // and "o"
  const Stroke& o = strokeOf("o");
  between.insert(between.end(), o.begin(), o.begin() + static_cast<std::ptrdiff_t>(o.size() / 4));
  StrokeReader strict(shipped(), {.leastMargin = 0.99});
  EXPECT_EQ(readingOf(strict, between).kind, Kind::kDoubtful);
  StrokeReader narrow(shipped(), {.mostDistance = 100.0});
  EXPECT_EQ(readingOf(narrow, between).kind, Kind::kDoubtful) << "unlike all";
  EXPECT_EQ(readingOf(narrow, strokeOf("u")).symbol, "u");
}

}  // namespace
}  // namespace traction::input

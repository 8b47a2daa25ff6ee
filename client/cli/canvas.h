// A page of characters in colour, composed in memory and written to the terminal in one go.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace traction::cli {

struct Colour24 {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Colour24& other) const = default;
};

bool isLight(Colour24 colour);

/// share = 0: from, 1: to.
Colour24 mix(Colour24 from, Colour24 to, double share);

enum class Depth {
  kNone,  ///< bold and reversed alone
  k256,
  kTrueColour,
};

enum class Glyphs {
  kUnicode,
  kAscii,  ///< for a terminal that shows no others: each is put by one that resembles it
};

struct Style {
  Colour24 ink{205, 208, 216};
  Colour24 paper{14, 16, 24};
  bool bold = false;
  bool operator==(const Style& other) const = default;
};

/// Everything outside is cut off. Every character is one column wide.
class Canvas {
 public:
  Canvas(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  enum class Paper {
    kOfStyle,
    kKept,  ///< what is there shows through; the ink is darkened where that is light
  };

  /// UTF-8; returns the column behind it.
  int text(int column, int row, std::string_view utf8, const Style& style = {}, Paper paper = Paper::kOfStyle);
  void fill(int column, int row, int width, int height, const Style& style);
  void frame(int column, int row, int width, int height, const Style& style);

  /// The page as it is sent to a terminal, from the top left corner.
  std::string render(Depth depth, Glyphs glyphs = Glyphs::kUnicode) const;
  /// Its characters alone, a line a row.
  std::string plain(Glyphs glyphs = Glyphs::kUnicode) const;

 private:
  struct Cell {
    std::string glyph = " ";
    Style style;
  };
  Cell* at(int column, int row);

  int width_;
  int height_;
  std::vector<Cell> cells_;
};

/// Dots at 2 x 4 per character, in Braille.
class Dots {
 public:
  Dots(int columns, int rows);

  int width() const { return 2 * columns_; }
  int height() const { return 4 * rows_; }
  void set(int x, int y);  ///< y down
  void line(double x0, double y0, double x1, double y1);
  void paint(Canvas& canvas, int column, int row, const Style& style,
             Canvas::Paper paper = Canvas::Paper::kOfStyle) const;

 private:
  int columns_;
  int rows_;
  std::vector<std::uint8_t> patterns_;
};

}  // namespace traction::cli

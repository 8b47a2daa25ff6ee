// A page of coloured characters that is composed in memory and written to the terminal at once.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace traction::client {

/// A colour of 24 bits (sRGB).
struct Colour24 {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Colour24& other) const = default;
};

/// Returns whether dark text is legible on the colour.
bool isLight(Colour24 colour);

/// Mixes two colours: share 0 gives `from`, 1 gives `to`; it is limited to [0, 1].
Colour24 mix(Colour24 from, Colour24 to, double share);

/// Colours that a terminal can show.
enum class Depth {
  kNone,  ///< no colours, only bold and reverse video
  k256,
  kTrueColour,
};

/// How a character is drawn.
struct Style {
  Colour24 ink{205, 208, 216};  ///< colour of the character
  Colour24 paper{14, 16, 24};   ///< colour of the background
  bool bold = false;
  bool operator==(const Style& other) const = default;
};

/// Returns the number of columns that a text takes.
int columnsOf(std::string_view utf8);

/// Breaks a text into lines, each with a space on either side; a longer word has a line of its own.
/// \param width in columns, with the spaces
std::vector<std::string> wrapped(std::string_view text, int width);

/// A grid of characters, each one column wide. Columns and rows count from 0 at the top left corner. Whatever lies
/// outside is clipped. Thread-bound.
class Canvas {
 public:
  /// Makes a page of blanks.
  /// \param width columns
  /// \param height rows; negative ones count as 0
  Canvas(int width, int height);

  int width() const { return width_; }    ///< Returns the number of columns.
  int height() const { return height_; }  ///< Returns the number of rows.

  enum class Paper {
    kOfStyle,
    kKept,  ///< keeps the background; the text is darkened where the background is light
  };

  /// Writes UTF-8 text, one character per column, and returns the column after it, also if that lies outside. Does not
  /// break lines. What is not printable becomes '?'.
  int text(int column, int row, std::string_view utf8, const Style& style = {}, Paper paper = Paper::kOfStyle);
  /// Fills a rectangle with spaces.
  void fill(int column, int row, int width, int height, const Style& style);
  /// Draws the border of a rectangle with rounded corners; the inside stays as it is.
  /// \param width, height must be at least 2: this is not checked
  void frame(int column, int row, int width, int height, const Style& style);

  /// Returns the page as a terminal needs it, from the top left corner: UTF-8 with escape sequences, without line ends.
  std::string render(Depth depth) const;

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

/// Dots at 2 x 4 per character, drawn as Braille characters. Dots outside are ignored.
class Dots {
 public:
  /// \param columns, rows size in characters; negative ones count as 0
  Dots(int columns, int rows);

  int width() const { return 2 * columns_; }  ///< Returns the width in dots.
  int height() const { return 4 * rows_; }    ///< Returns the height in dots.
  void set(int x, int y);                     ///< Sets a dot; y points down.
  /// Sets the dots nearest to a line from (x0, y0) to (x1, y1), ends included, as far as they lie on the page. Draws
  /// nothing if a number is not finite. Takes as long as the line is, also where it lies outside.
  void line(double x0, double y0, double x1, double y1);
  /// Draws the characters that have dots onto the canvas, the top left one at (column, row).
  void paint(Canvas& canvas, int column, int row, const Style& style,
             Canvas::Paper paper = Canvas::Paper::kOfStyle) const;

 private:
  int columns_;
  int rows_;
  std::vector<std::uint8_t> patterns_;
};

}  // namespace traction::client

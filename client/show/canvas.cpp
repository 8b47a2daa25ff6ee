#include "client/show/canvas.h"

#include "base/printable.h"

#include <algorithm>
#include <cmath>

namespace traction::client {

namespace {

/// Returns the index in the terminal's cube of 6 x 6 x 6 colours.
int paletteIndex(Colour24 colour) {
  constexpr std::array<int, 6> kLevels = {0, 95, 135, 175, 215, 255};
  const auto nearest = [&](int value) {
    const auto closer = [&](int a, int b) { return std::abs(a - value) < std::abs(b - value); };
    return static_cast<int>(std::min_element(kLevels.begin(), kLevels.end(), closer) - kLevels.begin());
  };
  // The cube has few dark colours; its greys have many.
  const auto [low, high] = std::minmax({colour.red, colour.green, colour.blue});
  if (high - low < 14 && high < 246) return 232 + std::clamp((high + low - 10) / 20, 0, 23);
  return 16 + 36 * nearest(colour.red) + 6 * nearest(colour.green) + nearest(colour.blue);
}

void select(std::string& out, const char* what, Colour24 colour, Depth depth) {
  out += what;
  if (depth == Depth::kTrueColour) {
    out += ";2;" + std::to_string(colour.red) + ";" + std::to_string(colour.green) + ";" + std::to_string(colour.blue);
  } else {
    out += ";5;" + std::to_string(paletteIndex(colour));
  }
}

}  // namespace

bool isLight(Colour24 colour) {
  return 0.299 * colour.red + 0.587 * colour.green + 0.114 * colour.blue > 128.0;  // perceived brightness
}

Colour24 mix(Colour24 from, Colour24 to, double share) {
  const auto between = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + (b - a) * std::clamp(share, 0.0, 1.0)));
  };
  return {between(from.red, to.red), between(from.green, to.green), between(from.blue, to.blue)};
}

int columnsOf(std::string_view utf8) {
  return static_cast<int>(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

std::vector<std::string> wrapped(std::string_view text, int width) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    if (lines.empty() || columnsOf(lines.back()) + 1 + columnsOf(word) > width) {
      lines.push_back(" " + std::string(word) + " ");
    } else {
      lines.back().append(word).append(" ");
    }
    text.remove_prefix(std::min(word.size() + 1, text.size()));
  }
  return lines;
}

Canvas::Canvas(int width, int height)
    : width_(std::max(width, 0))
    , height_(std::max(height, 0))
    , cells_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

Canvas::Cell* Canvas::at(int column, int row) {
  if (column < 0 || row < 0 || column >= width_ || row >= height_) return nullptr;
  return &cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)];
}

int Canvas::text(int column, int row, std::string_view utf8, const Style& style, Paper paper) {
  while (!utf8.empty()) {
    const std::size_t length = std::min(utf8Length(utf8[0]), utf8.size());
    if (Cell* cell = at(column, row)) {
      const Colour24 below = cell->style.paper;
      *cell = {printable(utf8.substr(0, length)).substr(0, length), style};
      if (paper == Paper::kKept) cell->style.paper = below;
      if (paper == Paper::kKept && isLight(below)) cell->style.ink = mix(style.ink, {}, 0.8);
    }
    utf8.remove_prefix(length);
    ++column;
  }
  return column;
}

void Canvas::fill(int column, int row, int width, int height, const Style& style) {
  for (int y = row; y < row + height; ++y) {
    for (int x = column; x < column + width; ++x) text(x, y, " ", style);
  }
}

void Canvas::frame(int column, int row, int width, int height, const Style& style) {
  const int right = column + width - 1;
  const int bottom = row + height - 1;
  for (int x = column + 1; x < right; ++x) {
    text(x, row, "─", style);
    text(x, bottom, "─", style);
  }
  for (int y = row + 1; y < bottom; ++y) {
    text(column, y, "│", style);
    text(right, y, "│", style);
  }
  text(column, row, "╭", style);
  text(right, row, "╮", style);
  text(column, bottom, "╰", style);
  text(right, bottom, "╯", style);
}

std::string Canvas::render(Depth depth) const {
  std::string out = "\x1b[H";
  for (int row = 0; row < height_; ++row) {
    out += "\x1b[" + std::to_string(row + 1) + ";1H";
    const Style* before = nullptr;
    for (int column = 0; column < width_; ++column) {
      const Cell& cell = cells_[static_cast<std::size_t>(row * width_ + column)];
      if (before == nullptr || !(*before == cell.style)) {
        out += cell.style.bold ? "\x1b[0;1" : "\x1b[0";
        if (depth != Depth::kNone) {
          select(out, ";38", cell.style.ink, depth);
          select(out, ";48", cell.style.paper, depth);
        } else if (isLight(cell.style.paper)) {
          out += ";7";
        }
        out += 'm';
        before = &cell.style;
      }
      out += cell.glyph;
    }
  }
  return out + "\x1b[0m";
}

Dots::Dots(int columns, int rows)
    : columns_(std::max(columns, 0))
    , rows_(std::max(rows, 0))
    , patterns_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

void Dots::set(int x, int y) {
  if (x < 0 || y < 0 || x >= width() || y >= height()) return;
  // Unicode numbers the dots of a character downwards, first column, second column; the bottom row came later.
  constexpr std::array<std::array<std::uint8_t, 4>, 2> kBits = {{{1, 2, 4, 64}, {8, 16, 32, 128}}};
  patterns_[static_cast<std::size_t>(y / 4 * columns_ + x / 2)] |=
      kBits[static_cast<std::size_t>(x % 2)][static_cast<std::size_t>(y % 4)];
}

void Dots::line(double x0, double y0, double x1, double y1) {
  if (!std::isfinite(x1 - x0) || !std::isfinite(y1 - y0)) return;
  const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    set(static_cast<int>(std::lround(x0 + (x1 - x0) * share)), static_cast<int>(std::lround(y0 + (y1 - y0) * share)));
  }
}

void Dots::paint(Canvas& canvas, int column, int row, const Style& style, Canvas::Paper paper) const {
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      const auto pattern = patterns_[static_cast<std::size_t>(y * columns_ + x)];
      // U+2800 + pattern
      const std::string glyph = {'\xe2', static_cast<char>(0xa0 | (pattern >> 6)),
                                 static_cast<char>(0x80 | (pattern & 63))};
      if (pattern != 0) canvas.text(column + x, row + y, glyph, style, paper);
    }
  }
}

}  // namespace traction::client

// Tells which of the known strokes one is most like, by $Q (Vatavu, Anthony, Wobbrock 2018): each is a cloud of 32
// points, of any size and place, and of no direction. Two clouds are matched greedily, from several starts, which end
// as soon as they are worse than what is known; a table of the nearest point of each cell bounds them from below before
// that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace traction::input {

/// Points in the order of drawing, in any unit; x to the right, y up.
using Stroke = std::vector<std::array<double, 2>>;

/// Reentrant, but for add().
class Recogniser {
 public:
  struct Best {
    std::string symbol;  ///< empty: no stroke is known, or the stroke is a point
    double distance = std::numeric_limits<double>::infinity();
    /// 1 - distance / that of the second best symbol: 0, as like the one as the other; 1, no other.
    double margin = 0.0;
  };

  /// Adds a way to draw a symbol; there may be several. One that is a point is not added.
  void add(const std::string& symbol, const Stroke& stroke);
  /// Returns the symbol that a stroke is most like.
  Best recognise(const Stroke& stroke) const;

 private:
  static constexpr std::size_t kPoints = 32;
  static constexpr std::size_t kCells = 64;
  struct Cloud {
    std::array<std::array<double, 2>, kPoints> points{};  ///< 0 to kCells - 1
    /// Index of the point nearest to each cell, row by row.
    std::array<std::uint8_t, kCells * kCells> nearest{};
    bool isPoint = true;
  };
  struct Known {
    std::string symbol;
    Cloud cloud;
  };

  static Cloud cloudOf(const Stroke& stroke);
  static double match(const Cloud& one, const Cloud& other, double worst);
  static double distance(const Cloud& from, const Cloud& to, std::size_t start, double worst);
  static std::array<double, 6> lowerBounds(const Cloud& from, const Cloud& to);

  std::vector<Known> known_;
};

}  // namespace traction::input

// The parts of the live view. Internal to picture*.cpp.
#pragma once

#include "client/show/page.h"
#include "client/show/picture.h"

#include <numbers>
#include <string>

namespace traction::client {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;
inline constexpr Style kShear{{90, 255, 240}, kPaper, true};

/// Returns the next 1, 2 or 5 times a power of ten that is not smaller.
/// \param value above 0
double roundUp(double value);

/// Sets the dots of an arrow from (x, y) to its tip at (x + dx, y + dy) [dots, y down]; without a head if it is shorter
/// than 2 dots.
void drawArrow(Dots& dots, double x, double y, double dx, double dy);

// ---- picture_field.cpp

/// Number of the field's cells, and the room that they take with their frame [characters].
struct Layout {
  int columns, rows;
  int width() const { return 2 * columns + 2; }
  int height() const { return rows + 2; }
};

/// Returns the largest layout for a field of nodeColumns x nodeRows nodes that fits with its frame into a rectangle of
/// width x height characters; at least 1 x 1 cells, even if these do not fit.
Layout layoutFor(int nodeColumns, int nodeRows, int width, int height);

struct DrawnField {
  double full_N = 0.0;  ///< the force per node of full brightness; 0: no field
  /// Why there are no current forces, if it did not fit; warnings that do not fit are left out.
  std::string untold;
};

/// Draws the frame with warnings in its upper edge, and in it the field, grey if it is out of date, and why there are
/// no current forces.
/// \param column, row top left corner of the frame
/// \param scale updated if the field is drawn
/// \param now_ns CLOCK_MONOTONIC
DrawnField drawField(Canvas& canvas, const Scene& scene, const Layout& layout, int column, int row, Scale& scale,
                     std::int64_t now_ns);

/// Writes into a row of the canvas what shades and arrows mean.
/// \param full_N of DrawnField; if it is 0, the force per node of full brightness is left out
void drawLegend(Canvas& canvas, int row, double full_N);

// ---- picture_panel.cpp

struct Rectangle {
  int column, row, width, height;
};

/// Writes the numbers beside the field, most important first; leaves out those for which there are no rows.
/// \param place in characters, from the top left corner
/// \param now_ns CLOCK_MONOTONIC
/// \param untold of DrawnField, written first
void drawPanel(Canvas& canvas, const Rectangle& place, const Scene& scene, std::int64_t now_ns,
               const std::string& untold);

}  // namespace traction::client

#include "daemon/track/lattice.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace tractiond::track {

namespace {

constexpr float kContradiction =
    0.5F;                          // of the spacing, between neighbours: a swap (1.0) less a slope (0.4) is above this
constexpr float kOutlier = 0.25F;  // share of the spacing, from the mean of the neighbours on both sides
constexpr int kAround = 4;         // number of the eight nodes around a gap

}  // namespace

LatticeSeen extentWith(const LatticeSeen& seen, const Lattice& lattice, std::span<const std::uint8_t> there) {
  const auto extent = [](int lines, int length, const auto& isThere) {
    int first = lines, last = -1;
    for (int line = 0; line < lines; ++line) {
      int count = 0;
      for (int i = 0; i < length; ++i) count += isThere(line, i) ? 1 : 0;
      if (2 * count < length) continue;
      first = std::min(first, line);
      last = line;
    }
    return std::max(last - first + 1, 0);
  };
  const auto at = [&](int column, int row) { return there[static_cast<std::size_t>(lattice.at(column, row))] != 0; };
  const int columns = extent(lattice.columns, lattice.rows, at);
  const int rows = extent(lattice.rows, lattice.columns, [&](int row, int column) { return at(column, row); });
  return {std::max(seen.columns, columns), std::max(seen.rows, rows)};
}

int isolatedGaps(const Lattice& lattice, std::span<const std::uint8_t> there) {
  const auto isThere = [&](int column, int row) {
    return lattice.has(column, row) && there[static_cast<std::size_t>(lattice.at(column, row))] != 0;
  };
  int gaps = 0;
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column) {
      if (isThere(column, row)) continue;
      int around = 0;
      for (int i = 0; i < 9; ++i) around += isThere(column + i % 3 - 1, row + i / 3 - 1) ? 1 : 0;
      if (around >= kAround) ++gaps;
    }
  }
  return gaps;
}

std::vector<Lattice> latticesOf(const sensor::Sensor& sensor) {
  std::vector<Lattice> lattices;
  int first = 0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    lattices.push_back({first, layer.columns, layer.rows});
    first += layer.count();
  }
  return lattices;
}

std::optional<Vector> expectation(const Lattice& lattice, int node, std::span<const Vector> field,
                                  std::span<const std::uint8_t> valid) {
  const int column = (node - lattice.first) % lattice.columns, row = (node - lattice.first) / lattice.columns;
  PlaneFit plane;
  bool isBeside = false;
  for (int y = std::max(-2, -row); y <= std::min(2, lattice.rows - 1 - row); ++y) {
    for (int x = std::max(-2, -column); x <= std::min(2, lattice.columns - 1 - column); ++x) {
      const int beside = lattice.at(column + x, row + y);
      if (beside == node || !valid[beside]) continue;
      isBeside = isBeside || (std::abs(x) < 2 && std::abs(y) < 2);
      const auto dx = static_cast<float>(x), dy = static_cast<float>(y);
      plane.add(1.0F / (dx * dx + dy * dy), dx, dy, field[beside]);
    }
  }
  if (!isBeside) return std::nullopt;
  plane.solve();
  return plane.at(0.0F, 0.0F);
}

Trust::Trust(const Lattice& lattice, float spacing_px)
    : lattice_(lattice)
    , limit2_(kContradiction * kContradiction * spacing_px * spacing_px)
    , piece_(static_cast<std::size_t>(lattice.count()))
    , stack_(static_cast<std::size_t>(lattice.count())) {}

void Trust::prune(std::span<const Vector> displacement, std::span<std::uint8_t> valid, bool thorough) {
  dropOutliers(displacement, valid);
  if (thorough || anyContradiction(displacement, valid)) keepLargestPiece(displacement, valid);
}

bool Trust::anyContradiction(std::span<const Vector> displacement, std::span<const std::uint8_t> valid) const {
  for (int row = 0; row < lattice_.rows; ++row) {
    for (int column = 0; column < lattice_.columns; ++column) {
      const int node = lattice_.at(column, row), right = node + 1, up = node + lattice_.columns;
      if (!valid[node]) continue;
      if (column + 1 < lattice_.columns && valid[right] && contradicts(displacement, node, right)) return true;
      if (row + 1 < lattice_.rows && valid[up] && contradicts(displacement, node, up)) return true;
    }
  }
  return false;
}

void Trust::dropOutliers(std::span<const Vector> displacement, std::span<std::uint8_t> valid) {
  const float limit2 = limit2_ * (kOutlier * kOutlier) / (kContradiction * kContradiction);
  enum class Verdict { kUnknown, kAgrees, kDiffers, kDiffersFromBoth };
  const auto between = [&](int node, int step) {
    if (!valid[node - step] || !valid[node + step]) return Verdict::kUnknown;
    const Vector before = displacement[node - step], after = displacement[node + step];
    if ((displacement[node] - 0.5F * (before + after)).squared() <= limit2) return Verdict::kAgrees;
    const bool both =
        (displacement[node] - before).squared() > limit2 && (displacement[node] - after).squared() > limit2;
    return both ? Verdict::kDiffersFromBoth : Verdict::kDiffers;
  };
  for (int row = 0; row < lattice_.rows; ++row) {
    for (int column = 0; column < lattice_.columns; ++column) {
      const int node = lattice_.at(column, row);
      if (!valid[node]) continue;
      const bool inRow = column > 0 && column + 1 < lattice_.columns, inColumn = row > 0 && row + 1 < lattice_.rows;
      const Verdict across = inRow ? between(node, 1) : Verdict::kUnknown;
      if (across == Verdict::kAgrees) continue;
      const Verdict along = inColumn ? between(node, lattice_.columns) : Verdict::kUnknown;
      if (along == Verdict::kAgrees) continue;
      // With a single pair the outlier may be in the pair; then this marker differs from one of the two only.
      const bool twice = across != Verdict::kUnknown && along != Verdict::kUnknown;
      if (!twice && across != Verdict::kDiffersFromBoth && along != Verdict::kDiffersFromBoth) continue;
      valid[node] = 0;
    }
  }
}

void Trust::keepLargestPiece(std::span<const Vector> displacement, std::span<std::uint8_t> valid) {
  // Diagonal neighbours and neighbours across one gap are connected, too.
  constexpr std::array<std::array<int, 2>, 12> kLinks = {
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}, {2, 0}, {-2, 0}, {0, 2}, {0, -2}}};
  std::fill(piece_.begin(), piece_.end(), -1);
  int largest = -1, most = 0, pieces = 0;
  for (int start = 0; start < lattice_.count(); ++start) {
    if (piece_[start] >= 0 || !valid[lattice_.first + start]) continue;
    int size = 0, open = 0;
    stack_[open++] = start;
    piece_[start] = pieces;
    while (open > 0) {
      const int node = stack_[--open];
      ++size;
      for (const auto& [x, y] : kLinks) {
        const int column = node % lattice_.columns + x, row = node / lattice_.columns + y;
        if (!lattice_.has(column, row)) continue;
        const int next = row * lattice_.columns + column;
        if (piece_[next] >= 0 || !valid[lattice_.first + next]) continue;
        if (contradicts(displacement, lattice_.first + node, lattice_.first + next)) continue;
        piece_[next] = pieces;
        stack_[open++] = next;
      }
    }
    if (size > most) {
      most = size;
      largest = pieces;
    }
    ++pieces;
  }
  for (int node = 0; node < lattice_.count(); ++node) {
    if (piece_[node] != largest) valid[lattice_.first + node] = 0;
  }
  dropContradicting(displacement, valid);
}

/// Drops both of two neighbours that contradict each other within a piece, which other nodes connect: which of them is
/// wrong is not known.
void Trust::dropContradicting(std::span<const Vector> displacement, std::span<std::uint8_t> valid) {
  std::fill(piece_.begin(), piece_.end(), 0);
  for (int row = 0; row < lattice_.rows; ++row) {
    for (int column = 0; column < lattice_.columns; ++column) {
      const int node = lattice_.at(column, row);
      const auto compare = [&](int other) {
        if (!valid[node] || !valid[other] || !contradicts(displacement, node, other)) return;
        piece_[node - lattice_.first] = piece_[other - lattice_.first] = 1;
      };
      if (column + 1 < lattice_.columns) compare(node + 1);
      if (row + 1 < lattice_.rows) compare(node + lattice_.columns);
    }
  }
  for (int node = 0; node < lattice_.count(); ++node) {
    if (piece_[node] == 1) valid[lattice_.first + node] = 0;
  }
}

}  // namespace tractiond::track

// A seed is a spot whose four neighbours are closest to the places that the reference gives; the gel is calm there. The
// lattice grows from it. The next node is always that with the most labelled neighbours; its place is extrapolated by a
// plane through their displacements, and the single spot at that place is assigned to it. Steep regions are therefore
// entered last and from several sides. All labels may then be wrong by any number of rows and columns, since a shifted
// picture looks the same inside. Therefore the lattice grows as far as there are spots, and each shift gets a score, by
// the markers that would lie outside the described lattice and by those that should be in the picture but are missing.
// The motion of the picture, and the agreement of the layers, have small weights: at the start they decide only if the
// rims cannot be seen.
#include "daemon/track/labelling.h"

#include "daemon/track/nominal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::track {

namespace {

constexpr float kReach = 0.40F;     // largest distance of a spot from the expected place, share of the spacing
constexpr float kRunnerUp = 0.25F;  // by which the second nearest spot must be farther, share of the spacing
constexpr float kSeedReach = 0.35F;
constexpr int kSeeds = 4;
constexpr float kOutsideCost = 2.0F;  // cost of a spot that would be no marker; a marker without a spot costs 1
constexpr float kMoveCost = 0.005F;   // cost per marker of a motion by one spacing; grows with its square
// Cost per marker of the lattice's shorter side, of a motion by more than half a spacing since an earlier picture: a
// few missing markers of a rim at the picture's border do not justify it.
constexpr float kJumpCost = 1.0F;
constexpr float kFirstMoveCost = 0.002F;  // kMoveCost without an earlier picture; grows in proportion
constexpr float kLayerCost = 0.03F;       // cost per marker of layers that are one spacing apart
constexpr std::size_t kBestShifts = 64;   // shifts of a layer that are combined with those of the other
constexpr float kUnsure = 0.2F;           // uncertainty of a missing marker's place, share of the spacing
constexpr float kFull = 0.5F;             // share of the visible nodes of a column that must have spots
constexpr int kFewestOfColumn = 4;        // visible nodes that are needed to judge a column

}  // namespace

Labeller::Labeller(const std::vector<Lattice>& lattices, int width_px, int height_px, int spots)
    : width_(static_cast<float>(width_px))
    , height_(static_cast<float>(height_px))
    , seen_(lattices.size())
    , grid_(width_px, height_px, 16.0F, spots) {
  for (const Lattice& lattice : lattices) {
    Work work;
    work.lattice = lattice;
    work.slackX = lattice.columns - 2;  // covers any two pictures that share a column
    work.slackY = lattice.rows - 2;
    const Lattice wide{0, lattice.columns + 2 * work.slackX, lattice.rows + 2 * work.slackY};
    work.wide = wide;
    const auto nodes = static_cast<std::size_t>(wide.count());
    work.reference.resize(nodes);
    work.displacement.resize(nodes);
    work.spot.resize(nodes);
    for (auto* flags : {&work.has, &work.tried, &work.neighbours, &work.visible}) flags->resize(nodes);
    work.open.reserve(nodes);
    work.taken.resize(static_cast<std::size_t>(spots));
    const auto corners = static_cast<std::size_t>((wide.columns + 1) * (wide.rows + 1));
    work.hasSum.resize(corners);
    work.missingSum.resize(corners);
    work.displacementSum.resize(corners);
    work.shifts.reserve(static_cast<std::size_t>((2 * work.slackX + 1) * (2 * work.slackY + 1)));
    works_.push_back(std::move(work));
  }
}

bool Labeller::label(std::span<const std::span<const Spot>> spots, std::span<const Vector> reference_px,
                     const LabelOptions& options, std::span<Vector> place_px, std::span<std::uint8_t> labelled) {
  for (std::size_t layer = 0; layer < works_.size(); ++layer) {
    prepare(works_[layer], spots[layer], reference_px);
    if (!grow(works_[layer], spots[layer])) return false;
    findVisible(works_[layer], options.border_px + kUnsure * works_[layer].spacing);
    scoreShifts(works_[layer], options.seenBefore);
  }
  chooseShifts();
  for (std::size_t layer = 0; layer < works_.size(); ++layer) {
    const Work& work = works_[layer];
    const int left = work.slackX - work.chosen.x, low = work.slackY - work.chosen.y;
    int found = 0;
    for (int row = 0; row < work.lattice.rows; ++row) {
      for (int column = 0; column < work.lattice.columns; ++column) {
        const int marker = work.lattice.at(column, row);
        const int node = work.wide.at(column + left, row + low);
        labelled[marker] = work.has[node];
        if (!work.has[node]) continue;
        const Spot& spot = spots[layer][work.spot[node]];
        place_px[marker] = {spot.u, spot.v};
        ++found;
      }
    }
    if (found < options.least * work.lattice.count()) return false;
    seen_[layer] = extent(work);
  }
  return true;
}

/// Chooses the shifts that fit best and agree with each other. There are two layers at most, one of each colour.
void Labeller::chooseShifts() {
  Work& one = works_.front();
  Work& other = works_.back();
  one.chosen = one.shifts.front();
  if (works_.size() == 1) return;
  const float cost = kLayerCost * static_cast<float>(one.lattice.count()) / (one.spacing * one.spacing);
  float best = -std::numeric_limits<float>::infinity();
  for (const Shift& a : one.shifts) {
    for (const Shift& b : other.shifts) {
      const float score = a.score + b.score - cost * (a.mean - b.mean).squared();
      if (score <= best) continue;
      best = score;
      one.chosen = a;
      other.chosen = b;
    }
  }
}

void Labeller::prepare(Work& work, std::span<const Spot> spots, std::span<const Vector> reference) {
  const Lattice& lattice = work.lattice;
  const Lattice& wide = work.wide;
  for (int row = 0; row < wide.rows; ++row) {
    for (int column = 0; column < wide.columns; ++column) {
      const int c = std::clamp(column - work.slackX, 0, lattice.columns - 1),
                r = std::clamp(row - work.slackY, 0, lattice.rows - 1);
      const int inwardC = c > 0 ? c - 1 : c + 1, inwardR = r > 0 ? r - 1 : r + 1;
      const Vector border = reference[lattice.at(c, r)];
      const auto overC = static_cast<float>(std::abs(column - work.slackX - c)),
                 overR = static_cast<float>(std::abs(row - work.slackY - r));
      work.reference[wide.at(column, row)] = border + overC * (border - reference[lattice.at(inwardC, r)]) +
                                             overR * (border - reference[lattice.at(c, inwardR)]);
    }
  }
  work.spacing = smallestSpacing(reference, {&lattice, 1});
  grid_.clear();
  for (std::size_t i = 0; i < spots.size(); ++i) grid_.add(static_cast<int>(i), spots[i].u, spots[i].v);
}

int Labeller::nearest(const Work& work, std::span<const Spot> spots, Vector place, float reach, float* distance,
                      float* second) const {
  int best = -1;
  float best2 = std::numeric_limits<float>::infinity(), next2 = best2;
  grid_.near(place.u, place.v, reach, [&](int i) {
    if (work.taken[i]) return;
    const float d2 = (Vector{spots[i].u, spots[i].v} - place).squared();
    if (d2 < best2) {
      next2 = best2;
      best2 = d2;
      best = i;
    } else if (d2 < next2) {
      next2 = d2;
    }
  });
  *distance = std::sqrt(best2);
  if (second) *second = std::sqrt(next2);
  return *distance < reach ? best : -1;
}

bool Labeller::grow(Work& work, std::span<const Spot> spots) {
  std::fill(work.taken.begin(), work.taken.end(), std::uint8_t{0});
  struct Seed {
    float cost;
    int node, spot;
  };
  std::array<Seed, kSeeds> seeds;
  seeds.fill({std::numeric_limits<float>::infinity(), -1, -1});
  const float reach = kSeedReach * work.spacing;
  const Lattice& wide = work.wide;
  const int left = work.slackX, low = work.slackY;
  for (int row = low + 1; row + 1 < wide.rows - low; ++row) {
    for (int column = left + 1; column + 1 < wide.columns - left; ++column) {
      const int node = wide.at(column, row);
      const Vector at = work.reference[node];
      float distance = 0.0F;
      const int spot = nearest(work, spots, at, 0.75F * work.spacing, &distance, nullptr);
      if (spot < 0) continue;
      const Vector place{spots[spot].u, spots[spot].v};
      float cost = 0.0F;
      for (const int neighbour : {node - 1, node + 1, node - wide.columns, node + wide.columns}) {
        const Vector expected = place + (work.reference[neighbour] - at);
        if (nearest(work, spots, expected, reach, &distance, nullptr) < 0) distance = 2.0F * reach;
        cost += distance;
      }
      // Chooses seeds far from each other, so that one bad region does not contain all of them.
      const bool crowded = std::any_of(seeds.begin(), seeds.end(), [&](const Seed& seed) {
        return seed.node >= 0 && seed.cost <= cost &&
               (work.reference[seed.node] - at).squared() < 16.0F * work.spacing * work.spacing;
      });
      if (crowded || cost >= seeds.back().cost) continue;
      seeds.back() = {cost, node, spot};
      std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) { return a.cost < b.cost; });
    }
  }
  for (const Seed& seed : seeds) {
    if (seed.node >= 0 && 2 * growFrom(work, spots, seed.node, seed.spot) > work.lattice.count()) return true;
  }
  return false;
}

void Labeller::setSpot(Work& work, std::span<const Spot> spots, int node, int spot) {
  const Lattice& wide = work.wide;
  work.spot[node] = spot;
  work.has[node] = 1;
  work.taken[spot] = 1;
  work.displacement[node] = Vector{spots[spot].u, spots[spot].v} - work.reference[node];
  const int column = node % wide.columns, row = node / wide.columns;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      if (!wide.has(column + x, row + y)) continue;
      const int beside = wide.at(column + x, row + y);
      if (work.neighbours[beside]++ == 0) work.open.push_back(beside);
    }
  }
}

int Labeller::growFrom(Work& work, std::span<const Spot> spots, int seed, int spot) {
  const Lattice& wide = work.wide;
  std::fill(work.spot.begin(), work.spot.end(), -1);
  for (auto* flags : {&work.has, &work.tried, &work.neighbours, &work.taken}) {
    std::fill(flags->begin(), flags->end(), std::uint8_t{0});
  }
  work.open.clear();
  setSpot(work, spots, seed, spot);
  int grown = 1;
  for (;;) {
    std::erase_if(work.open, [&](int node) { return work.has[node] != 0; });
    int next = -1;
    for (const int node : work.open) {
      if (work.neighbours[node] <= work.tried[node]) continue;
      if (next < 0 || work.neighbours[node] > work.neighbours[next]) next = node;
    }
    if (next < 0) return grown;
    work.tried[next] = work.neighbours[next];
    const auto expected = expectation(wide, next, work.displacement, work.has);
    if (!expected) continue;
    float distance = 0.0F, second = 0.0F;
    const int found = nearest(work, spots, work.reference[next] + *expected, kReach * work.spacing, &distance, &second);
    if (found < 0 || second - distance < kRunnerUp * work.spacing) continue;
    setSpot(work, spots, next, found);
    ++grown;
  }
}

/// Determines which nodes the picture should show, and computes the sums.
void Labeller::findVisible(Work& work, float border_px) const {
  const Lattice& wide = work.wide;
  // Places far from all spots follow a plane through the motion of all nodes that have a spot.
  PlaneFit all;
  for (int node = 0; node < wide.count(); ++node) {
    if (!work.has[node]) continue;
    all.add(1.0F, static_cast<float>(node % wide.columns), static_cast<float>(node / wide.columns),
            work.displacement[node]);
  }
  all.solve();

  const int pitch = wide.columns + 1;
  for (int row = 0; row < wide.rows; ++row) {
    for (int column = 0; column < wide.columns; ++column) {
      const int node = wide.at(column, row);
      Vector moved = work.displacement[node];
      if (!work.has[node]) {
        const auto expected = expectation(wide, node, work.displacement, work.has);
        moved = expected ? *expected : all.at(static_cast<float>(column), static_cast<float>(row));
      }
      const Vector place = work.reference[node] + moved;
      const bool inside =
          place.u > border_px && place.v > border_px && place.u < width_ - border_px && place.v < height_ - border_px;
      work.visible[node] = inside ? 1 : 0;
      const int before = row * pitch + column, here = before + pitch + 1;
      const auto sum = [&](auto& sums, auto value) {
        sums[here] = sums[here - 1] + sums[before + 1] - sums[before] + value;
      };
      sum(work.hasSum, static_cast<int>(work.has[node]));
      sum(work.missingSum, inside && !work.has[node] ? 1 : 0);
      sum(work.displacementSum, work.has[node] ? moved : Vector{});
    }
  }
}

void Labeller::scoreShifts(Work& work, bool seenBefore) const {
  const Lattice& wide = work.wide;
  const Lattice& lattice = work.lattice;
  const int pitch = wide.columns + 1;
  const int grown = work.hasSum.back();
  const auto referenceAt = [&](int column, int row) {
    return work.reference[wide.at(column + work.slackX, row + work.slackY)];
  };
  const Vector acrossX = (1.0F / static_cast<float>(lattice.columns - 1)) *
                         (referenceAt(lattice.columns - 1, lattice.rows / 2) - referenceAt(0, lattice.rows / 2));
  const Vector acrossY = (1.0F / static_cast<float>(lattice.rows - 1)) *
                         (referenceAt(lattice.columns / 2, lattice.rows - 1) - referenceAt(lattice.columns / 2, 0));
  const int shorter = std::min(lattice.columns, lattice.rows);
  work.shifts.clear();
  for (int y = -work.slackY; y <= work.slackY; ++y) {
    for (int x = -work.slackX; x <= work.slackX; ++x) {
      const int low = (work.slackY - y) * pitch + work.slackX - x, high = low + lattice.rows * pitch;
      const auto within = [&](const auto& sums) {
        return sums[high + lattice.columns] - sums[high] - sums[low + lattice.columns] + sums[low];
      };
      const int inside = within(work.hasSum);
      if (inside == 0) continue;
      const Vector mean = (1.0F / static_cast<float>(inside)) * within(work.displacementSum) -
                          static_cast<float>(x) * acrossX - static_cast<float>(y) * acrossY;
      const float moved = std::sqrt(mean.squared()) / work.spacing;
      const float cost = seenBefore ? kMoveCost * moved * moved : kFirstMoveCost * moved;
      const float jump = seenBefore && moved > 0.5F ? kJumpCost * static_cast<float>(shorter) : 0.0F;
      const float score = -kOutsideCost * static_cast<float>(grown - inside) -
                          static_cast<float>(within(work.missingSum)) - cost * static_cast<float>(lattice.count()) -
                          jump;
      work.shifts.push_back({score, x, y, mean});
    }
  }
  const std::size_t best = std::min(kBestShifts, work.shifts.size());
  std::partial_sort(work.shifts.begin(), work.shifts.begin() + static_cast<std::ptrdiff_t>(best), work.shifts.end(),
                    [](const Shift& a, const Shift& b) { return a.score > b.score; });
  work.shifts.resize(best);
}

/// Returns the extent of the lattice. A column is present if most of its visible nodes have spots; if few nodes are
/// visible, the column is assumed to be present as described.
LatticeSeen Labeller::extent(const Work& work) const {
  const Lattice& wide = work.wide;
  const int left = work.slackX - work.chosen.x, low = work.slackY - work.chosen.y;
  // Returns the share of the line's visible nodes that have a spot; -1: too few are visible.
  const auto share = [&](bool column, int index) {
    const int length = column ? work.lattice.rows : work.lattice.columns;
    int visible = 0, there = 0;
    for (int i = 0; i < length; ++i) {
      const int x = left + (column ? index : i), y = low + (column ? i : index);
      if (!wide.has(x, y)) return -1.0F;
      const int node = wide.at(x, y);
      if (!work.visible[node]) continue;
      ++visible;
      there += work.has[node];
    }
    return visible < kFewestOfColumn ? -1.0F : static_cast<float>(there) / static_cast<float>(visible);
  };
  const auto count = [&](bool column, int described) {
    int seen = described;
    for (const int step : {-1, 1}) {
      const int rim = step < 0 ? 0 : described - 1;
      int beyond = 0, missing = 0;
      while (share(column, rim + step * (beyond + 1)) >= kFull) ++beyond;
      // Counts from the rim inwards to the first present line. Lines outside the picture count as missing only if a
      // visible one farther in is missing, too.
      for (int i = 0; i < described; ++i) {
        const float there = share(column, rim - step * i);
        if (there >= kFull) break;
        if (there >= 0.0F) missing = i + 1;
      }
      seen += beyond - missing;
    }
    return seen;
  };
  return {count(true, work.lattice.columns), count(false, work.lattice.rows)};
}

}  // namespace tractiond::track

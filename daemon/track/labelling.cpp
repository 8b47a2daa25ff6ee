// A seed is a spot whose four neighbours lie most nearly where the reference says; the gel is calm there. From it the
// lattice grows: always the node with the most labelled neighbours is next, its place is continued from theirs by a
// plane through their displacements, and it takes the one spot that lies there. So steep regions are entered last and
// from several sides. All labels may then be wrong by whole rows and columns, since a moved picture looks the same
// inside: each such shift is scored by the markers that would lie beyond the lattice and by those that should be in the
// picture but are not, a little by how far the picture moved, and by the layers' agreement.
#include "daemon/track/labelling.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::track {

namespace {

constexpr float kReach = 0.40F;     // of the spacing, from the expected place to the spot
constexpr float kRunnerUp = 0.25F;  // of the spacing, by which the next spot must be farther
constexpr float kSeedReach = 0.35F;
constexpr int kSeeds = 4;
constexpr float kOutsideCost = 2.0F;  // a spot that would be no marker; a marker without a spot costs 1
constexpr float kMoveCost = 0.005F;   // per marker, for a picture that moved by one spacing
constexpr float kLayerCost = 0.1F;    // per marker, for layers that are one spacing apart
constexpr float kMargin_px = 6.0F;    // a marker nearer to the border need not be seen

}  // namespace

Labeller::Labeller(const std::vector<Lattice>& lattices, int width_px, int height_px, int spots)
    : width_(static_cast<float>(width_px))
    , height_(static_cast<float>(height_px))
    , grid_(width_px, height_px, 16.0F, spots) {
  for (const Lattice& lattice : lattices) {
    Work work;
    work.lattice = lattice;
    work.wide = {0, lattice.columns + 2 * kSlack, lattice.rows + 2 * kSlack};
    const auto nodes = static_cast<std::size_t>(work.wide.count());
    work.reference.resize(nodes);
    work.displacement.resize(nodes);
    work.spot.resize(nodes);
    work.has.resize(nodes);
    work.tried.resize(nodes);
    work.neighbours.resize(nodes);
    work.taken.resize(static_cast<std::size_t>(spots));
    work.visible.resize(nodes);
    work.score.resize(kShift * kShift);
    work.mean.resize(kShift * kShift);
    works_.push_back(std::move(work));
  }
}

bool Labeller::label(std::span<const std::span<const Spot>> spots, std::span<const Vector> reference_px, double least,
                     std::span<Vector> place_px, std::span<std::uint8_t> labelled) {
  for (std::size_t layer = 0; layer < works_.size(); ++layer) {
    prepare(works_[layer], spots[layer], reference_px);
    if (!grow(works_[layer], spots[layer])) return false;
    scoreShifts(works_[layer]);
  }

  // Two layers at most: there are two colours.
  const Work& one = works_.front();
  const Work& other = works_.back();
  const float perSpacing2 = 1.0F / (one.spacing * one.spacing);
  const auto markers = static_cast<float>(one.lattice.count());
  int bestOne = 0, bestOther = 0;
  float best = -std::numeric_limits<float>::infinity();
  for (int a = 0; a < kShift * kShift; ++a) {
    for (int b = 0; b < kShift * kShift; ++b) {
      if (works_.size() == 1 && a != b) continue;
      const float apart2 = (one.mean[a] - other.mean[b]).squared() * perSpacing2;
      const float score = one.score[a] + other.score[b] - kLayerCost * markers * apart2;
      if (score > best) {
        best = score;
        bestOne = a;
        bestOther = b;
      }
    }
  }

  for (std::size_t layer = 0; layer < works_.size(); ++layer) {
    const Work& work = works_[layer];
    const int shift = layer == 0 ? bestOne : bestOther;
    const int x = shift % kShift - kSlack, y = shift / kShift - kSlack;
    int found = 0;
    for (int row = 0; row < work.lattice.rows; ++row) {
      for (int column = 0; column < work.lattice.columns; ++column) {
        const int marker = work.lattice.at(column, row);
        const int node = work.wide.at(column + kSlack - x, row + kSlack - y);
        const bool inside = work.wide.has(column + kSlack - x, row + kSlack - y) && work.spot[node] >= 0;
        labelled[marker] = inside ? 1 : 0;
        if (!inside) continue;
        const Spot& spot = spots[layer][work.spot[node]];
        place_px[marker] = {spot.u, spot.v};
        ++found;
      }
    }
    if (found < least * work.lattice.count()) return false;
  }
  return true;
}

void Labeller::prepare(Work& work, std::span<const Spot> spots, std::span<const Vector> reference) {
  const Lattice& lattice = work.lattice;
  for (int row = 0; row < work.wide.rows; ++row) {
    for (int column = 0; column < work.wide.columns; ++column) {
      const int c = std::clamp(column - kSlack, 0, lattice.columns - 1),
                r = std::clamp(row - kSlack, 0, lattice.rows - 1);
      const int inwardC = c > 0 ? c - 1 : c + 1, inwardR = r > 0 ? r - 1 : r + 1;
      const Vector border = reference[lattice.at(c, r)];
      const auto overC = static_cast<float>(std::abs(column - kSlack - c)),
                 overR = static_cast<float>(std::abs(row - kSlack - r));
      work.reference[work.wide.at(column, row)] = border + overC * (border - reference[lattice.at(inwardC, r)]) +
                                                  overR * (border - reference[lattice.at(c, inwardR)]);
    }
  }
  const Vector across = reference[lattice.at(lattice.columns - 1, 0)] - reference[lattice.at(0, 0)];
  work.spacing = std::sqrt(across.squared()) / static_cast<float>(lattice.columns - 1);
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
  for (int row = kSlack + 1; row + 1 < work.wide.rows - kSlack; ++row) {
    for (int column = kSlack + 1; column + 1 < work.wide.columns - kSlack; ++column) {
      const int node = work.wide.at(column, row);
      const Vector at = work.reference[node];
      float distance = 0.0F;
      const int spot = nearest(work, spots, at, 0.75F * work.spacing, &distance, nullptr);
      if (spot < 0) continue;
      const Vector place{spots[spot].u, spots[spot].v};
      float cost = 0.0F;
      for (const int neighbour : {node - 1, node + 1, node - work.wide.columns, node + work.wide.columns}) {
        const Vector expected = place + (work.reference[neighbour] - at);
        if (nearest(work, spots, expected, reach, &distance, nullptr) < 0) distance = 2.0F * reach;
        cost += distance;
      }
      // Far apart from each other, so that one bad place does not hold them all.
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
  work.spot[node] = spot;
  work.has[node] = 1;
  work.taken[spot] = 1;
  work.displacement[node] = Vector{spots[spot].u, spots[spot].v} - work.reference[node];
  const int column = node % work.wide.columns, row = node / work.wide.columns;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      if (work.wide.has(column + x, row + y)) ++work.neighbours[work.wide.at(column + x, row + y)];
    }
  }
}

int Labeller::growFrom(Work& work, std::span<const Spot> spots, int seed, int spot) {
  std::fill(work.spot.begin(), work.spot.end(), -1);
  std::fill(work.has.begin(), work.has.end(), std::uint8_t{0});
  std::fill(work.tried.begin(), work.tried.end(), std::uint8_t{0});
  std::fill(work.neighbours.begin(), work.neighbours.end(), std::uint8_t{0});
  std::fill(work.taken.begin(), work.taken.end(), std::uint8_t{0});
  setSpot(work, spots, seed, spot);
  int grown = 1;
  for (;;) {
    int next = -1;
    for (int node = 0; node < work.wide.count(); ++node) {
      if (work.has[node] || work.neighbours[node] <= work.tried[node]) continue;
      if (next < 0 || work.neighbours[node] > work.neighbours[next]) next = node;
    }
    if (next < 0) return grown;
    work.tried[next] = work.neighbours[next];
    const auto expected =
        expectation(work.wide, next % work.wide.columns, next / work.wide.columns, work.displacement, work.has);
    if (!expected) continue;
    float distance = 0.0F, second = 0.0F;
    const int found =
        nearest(work, spots, work.reference[next] + expected->value, kReach * work.spacing, &distance, &second);
    if (found < 0 || second - distance < kRunnerUp * work.spacing) continue;
    setSpot(work, spots, next, found);
    ++grown;
  }
}

void Labeller::scoreShifts(Work& work) const {
  for (int node = 0; node < work.wide.count(); ++node) {
    if (work.has[node]) continue;
    const auto expected =
        expectation(work.wide, node % work.wide.columns, node / work.wide.columns, work.displacement, work.has);
    const Vector place = work.reference[node] + (expected ? expected->value : Vector{});
    const bool visible =
        place.u > kMargin_px && place.v > kMargin_px && place.u < width_ - kMargin_px && place.v < height_ - kMargin_px;
    work.visible[node] = visible ? 1.0F : 0.0F;
  }
  const auto perSpacing2 = 1.0F / (work.spacing * work.spacing);
  for (int shift = 0; shift < kShift * kShift; ++shift) {
    const int x = shift % kShift - kSlack, y = shift / kShift - kSlack;
    float score = 0.0F;
    Vector sum;
    int inside = 0;
    for (int row = 0; row < work.wide.rows; ++row) {
      for (int column = 0; column < work.wide.columns; ++column) {
        const int node = work.wide.at(column, row);
        const int toColumn = column - kSlack + x, toRow = row - kSlack + y;  // in the true lattice
        const bool marker = work.lattice.has(toColumn, toRow);
        if (work.has[node]) {
          if (!marker) {
            score -= kOutsideCost;
            continue;
          }
          const Vector place = work.reference[node] + work.displacement[node];
          sum = sum + (place - work.reference[work.wide.at(toColumn + kSlack, toRow + kSlack)]);
          ++inside;
        } else if (marker) {
          score -= work.visible[node];
        }
      }
    }
    const Vector mean = inside > 0 ? (1.0F / static_cast<float>(inside)) * sum : Vector{};
    work.mean[shift] = mean;
    work.score[shift] = score - kMoveCost * static_cast<float>(work.lattice.count()) * mean.squared() * perSpacing2;
  }
}

}  // namespace tractiond::track

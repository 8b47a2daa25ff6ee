// The picture is summed in 1/64 levels as 16-bit integers, in the layout in which it is sent. A marker is added as a
// stamp: its blurred disc is drawn once for every 1/16 pixel of its centre, and the four stamps around the true centre
// are blended linearly. The blend of stamps of equal mass has the blended centroid, so the centre is exact; the shape
// is wider by less than 0.01 pixel. Where a nearer marker hides part of a marker, the blurred lens of their overlap is
// subtracted. Noise is a table of normal deviates that is read from a random offset in every row.
#include "twin/renderer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>

namespace twin {

namespace {

constexpr int kPhases = 16;        // per pixel
constexpr int kBrightest = 24000;  // units; the rest of the 16 bits is for noise
constexpr int kLoudest = 8000;     // units
constexpr std::size_t kNoiseCount = 1U << 16U;
constexpr float kDeviation = 4096.0F;  // standard deviation of the noise table if it is scaled per sample
constexpr int kLeastLensStrips = 24;
constexpr double kLensStripsPerPixel = 2.0;
constexpr int kLanes = 4;          // the width of a stamp is a multiple of this [px]
constexpr int kLargestStamp = 64;  // side; stamps of 512 px would take 300 MB per layer
constexpr int kPiece = 64;         // of a row that is added together [px]
// Limits of a marker's diameter or contrast, relative to its layer's.
constexpr double kLeastShare = 0.3, kMostShare = 1.7;
constexpr double kEdgeOn = 0.02;  // width over length of the thinnest marker that is drawn

Channel channelOf(sensor::Colour colour) {
  return colour == sensor::Colour::kBlue ? kBlue : colour == sensor::Colour::kRed ? kRed : kGreen;
}

/// Returns the radius of a layer's markers, if they face the camera [px].
double faceOnRadius(const sensor::MarkerLayer& layer, const sensor::Projection& project) {
  const Eigen::Vector3d middle(layer.centre.x(), layer.centre.y(), layer.depth);
  const Eigen::Matrix2d scale = project.jacobian(middle).leftCols<2>();
  return 0.5 * layer.diameter * std::sqrt(std::abs(scale.determinant()));
}

/// Returns two directions, 3 x 2, in the surface that a grid of points forms, of unit length and at a right angle:
/// along +x, and on the side of +y. Of a single row or column it faces z.
Eigen::Matrix<double, 3, 2> tangents(Eigen::Ref<const sensor::Points> grid, int columns, int rows, int column,
                                     int row) {
  const auto step = [&](int c0, int r0, int c1, int r1) -> Eigen::Vector3d {
    return grid.col(r1 * columns + c1) - grid.col(r0 * columns + c0);
  };
  Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  if (columns > 1 && rows > 1) {
    x = step(std::max(column - 1, 0), row, std::min(column + 1, columns - 1), row).normalized();
    y = step(column, std::max(row - 1, 0), column, std::min(row + 1, rows - 1));
    y = (y - y.dot(x) * x).normalized();
  }
  Eigen::Matrix<double, 3, 2> both;
  both << x, y;
  return both;
}

std::int16_t limited(int units) {
  return static_cast<std::int16_t>(std::clamp(units, 0, kBrightest));
}

std::int16_t rounded(float units) {
  return static_cast<std::int16_t>(units + (units < 0.0F ? -0.5F : 0.5F));
}

std::uint64_t scrambled(std::uint64_t x) {  // Steele, Lea and Flood 2014, SplitMix64
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

double position(int index, int size) {
  return size > 1 ? 2.0 * index / (size - 1) - 1.0 : 0.0;
}

}  // namespace

Renderer::Renderer(const sensor::Sensor& sensor, const Optics& optics, Format format)
    : format_(format)
    , traits_(&traitsOf(format))
    , samplesPerPixel_(samplesPerPixel(format))
    , cell_(cellOf(format))
    , width_(sensor.camera.width)
    , height_(sensor.camera.height)
    , columns_(static_cast<std::size_t>(width_) * samplesPerPixel_)
    , blur_(optics.blur_px)
    , gain_(optics.contrast * kUnits)
    , shotNoise_(optics.shotNoise)
    , readNoise_(optics.readNoise) {
  drawBackground(optics);
  light_.resize(background_.size());
  if (traits_->bits > 8) deep_.resize(background_.size());
  prepareDust(optics.dust);
  makeLayers(sensor, optics);
  makeNoise();
}

void Renderer::drawBackground(const Optics& optics) {
  for (int u = 0; u < width_; ++u) {
    const double x = position(u, width_);
    lightAcross_.push_back(static_cast<float>(1.0 + optics.lightSlope.x() * x - 0.5 * optics.lightFalloff * x * x));
  }
  for (int v = 0; v < height_; ++v) {
    const double y = position(v, height_);
    lightDown_.push_back(static_cast<float>(optics.lightSlope.y() * y - 0.5 * optics.lightFalloff * y * y));
  }
  background_.reserve(columns_ * static_cast<std::size_t>(height_));
  for (int v = 0; v < height_; ++v) {
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::size_t u = i / samplesPerPixel_;
      double level = optics.background * (lightDown_[v] + lightAcross_[u]);
      for (const Highlight& highlight : optics.highlights) {
        const Eigen::Vector2d from = Eigen::Vector2d(static_cast<double>(u), v) - highlight.centre_px;
        level += highlight.strength * std::exp(-0.5 * from.squaredNorm() / (highlight.radius_px * highlight.radius_px));
      }
      background_.push_back(limited(static_cast<int>(std::lround(level * kUnits))));
    }
  }
}

void Renderer::makeLayers(const sensor::Sensor& sensor, const Optics& optics) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  diameters_.assign(static_cast<std::size_t>(sensor.markerCount()), 1.0);
  contrasts_ = diameters_;
  drawVariety(optics.variety);
  stretch_ = {1.0 / std::sqrt(sensor.camera.aspect), std::sqrt(sensor.camera.aspect)};
  longest_ = stretch_.maxCoeff() * (ownShapes_ ? kMostShare * (1.0 + elongation_) : 1.0);
  if (sensor.body) foreshorten(sensor, project);
  int firstMarker = 0, widest = 0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    layers_.push_back(makeLayer(layer, firstMarker, faceOnRadius(layer, project), optics));
    firstMarker += layer.count();
    widest = std::max(widest, layers_.back().patch);
  }
  patch_.resize(static_cast<std::size_t>(widest) * static_cast<std::size_t>(widest));
}

void Renderer::makeNoise() {
  std::mt19937 generator;
  std::normal_distribution<double> normal;
  noise_.resize(kNoiseCount + columns_);
  const double deviation = shotNoise_ > 0.0 ? kDeviation : readNoise_ * kUnits;
  const double most = shotNoise_ > 0.0 ? std::numeric_limits<std::int16_t>::max() : kLoudest;
  for (std::size_t i = 0; i < kNoiseCount; ++i) {
    noise_[i] = static_cast<std::int16_t>(std::lround(std::clamp(deviation * normal(generator), -most, most)));
  }
  std::copy_n(noise_.begin(), columns_, noise_.begin() + kNoiseCount);
}

Strip Renderer::stretched(const Strip& strip) const {
  return {stretch_.y() * strip.y, stretch_.y() * strip.dy, stretch_.x() * strip.x0, stretch_.x() * strip.x1};
}

std::vector<Strip> Renderer::stretched(std::vector<Strip> region) const {
  for (Strip& strip : region) strip = stretched(strip);
  return region;
}

Renderer::Layer Renderer::makeLayer(const sensor::MarkerLayer& layer, int firstMarker, double radius_px,
                                    const Optics& optics) const {
  Layer made{firstMarker, layer.count(), layer.depth, radius_px, {}, 0, {}};
  const bool inAll = layer.colour == sensor::Colour::kGrey || traits_->colours == tractiond::PixelColours::kMono;
  const float sign = layer.darker ? -1.0F : 1.0F;
  made.weight.fill(sign * (inAll ? 1.0F : static_cast<float>(optics.crossTalk)));
  if (!inAll) made.weight[channelOf(layer.colour)] = sign;

  const double reach = longest_ * radius_px + blur_.reach();
  made.patch = 2 * static_cast<int>(std::ceil(reach)) + 2;
  const int stamp = (2 * static_cast<int>(reach) + 2 + kLanes - 1) / kLanes * kLanes;
  if (ownShapes_ || stamp > kLargestStamp) return made;
  made.patch = stamp;
  made.stamps = makeStamps(radius_px, stamp);
  return made;
}

std::vector<float> Renderer::makeStamps(double radius_px, int patch) const {
  const auto area = static_cast<std::size_t>(patch * patch);
  std::vector<float> stamps(area * (kPhases + 1) * (kPhases + 1));
  const std::vector<Strip> disc = stretched(ellipseStrips(radius_px, radius_px, 0.0));
  const int before = patch / 2 - 1;
  std::span<float> rest = stamps;
  for (int down = 0; down <= kPhases; ++down) {
    for (int across = 0; across <= kPhases; ++across) {
      blur_.add(disc, -before - across / double{kPhases}, -before - down / double{kPhases}, patch, gain_, rest);
      rest = rest.subspan(area);
    }
  }
  return stamps;
}

Eigen::Vector2i Renderer::corner(const Layer& layer, const Eigen::Vector2d& centre) const {
  return centre.array().floor().matrix().cast<int>().array() - (layer.patch / 2 - 1);
}

bool Renderer::isInSight(const Layer& layer, const Eigen::Vector2d& centre) const {
  const double margin = 0.5 * layer.patch;
  return centre.x() > -margin && centre.x() < width_ + margin && centre.y() > -margin && centre.y() < height_ + margin;
}

void Renderer::prepareDust(const std::vector<Speck>& dust) {
  for (const Speck& speck : dust) {
    const int half = static_cast<int>(std::ceil(speck.radius_px + blur_.reach())), size = 2 * half + 1;
    const int left = static_cast<int>(std::lround(speck.centre_px.x())) - half;
    const int top = static_cast<int>(std::lround(speck.centre_px.y())) - half;
    std::vector<float> cover(static_cast<std::size_t>(size * size));
    blur_.add(ellipseStrips(speck.radius_px, speck.radius_px, 0.0), left - speck.centre_px.x(),
              top - speck.centre_px.y(), size, 1.0, cover);
    for (int i = 0; i < size * size; ++i) {
      const int u = left + i % size, v = top + i / size;
      if (cover[i] <= 0.0F || u < 0 || u >= width_ || v < 0 || v >= height_) continue;
      const std::size_t first = static_cast<std::size_t>(v) * columns_ + static_cast<std::size_t>(u) * samplesPerPixel_;
      for (std::size_t k = 0; k < samplesPerPixel_; ++k)
        shades_.push_back({first + k, 1.0F - std::min(cover[i], 1.0F)});
    }
  }
}

void Renderer::render(const Eigen::Matrix2Xd& markers_px, std::uint32_t seed, std::span<std::uint8_t> picture,
                      double brightness) {
  assert(picture.size() == pictureSize() && markers_px.cols() == std::ssize(diameters_));
  std::copy(background_.begin(), background_.end(), light_.begin());
  for (const Layer& layer : layers_) {
    for (int i = layer.firstMarker; i < layer.firstMarker + layer.count; ++i) {
      if (!isInSight(layer, markers_px.col(i))) continue;
      if (layer.stamps.empty()) {
        drawOwnShape(layer, i, markers_px.col(i));
      } else {
        drawMarker(layer, markers_px.col(i));
      }
    }
  }
  hideBehindNearer(markers_px);
  dim(brightness);
  switch (traits_->bits) {
  case 8:
    return addNoise<6, 0>(seed, picture);
  case 10:
    addNoise<4, 0>(seed, std::span(deep_));
    break;
  case 12:
    addNoise<2, 0>(seed, std::span(deep_));
    break;
  default:
    addNoise<0, 2>(seed, std::span(deep_));
  }
  pack(format_, deep_, picture);
}

void Renderer::dim(double brightness) {
  if (brightness != 1.0) {
    const auto share = static_cast<float>(brightness);
    for (std::int16_t& light : light_) light = rounded(std::min(share * light, static_cast<float>(kBrightest)));
  }
  for (const Shade& shade : shades_) light_[shade.sample] = rounded(shade.clear * light_[shade.sample]);
}

void Renderer::drawMarker(const Layer& layer, const Eigen::Vector2d& centre) {
  const double u = std::floor(centre.x()), v = std::floor(centre.y());
  const double across = (centre.x() - u) * kPhases, down = (centre.y() - v) * kPhases;
  const int phaseAcross = std::min(static_cast<int>(across), kPhases - 1);
  const int phaseDown = std::min(static_cast<int>(down), kPhases - 1);
  const auto x = static_cast<float>(across - phaseAcross), y = static_cast<float>(down - phaseDown);
  const int size = layer.patch, area = size * size;
  const float* s00 = layer.stamps.data() + (phaseDown * (kPhases + 1) + phaseAcross) * area;
  const float* s10 = s00 + area;
  const float* s01 = s00 + (kPhases + 1) * area;
  const float* s11 = s01 + area;
  const float w00 = (1 - x) * (1 - y), w10 = x * (1 - y), w01 = (1 - x) * y, w11 = x * y;
  float* blended = patch_.data();
  for (int i = 0; i < area; i += kLanes) {
    for (int k = i; k < i + kLanes; ++k) blended[k] = w00 * s00[k] + w10 * s10[k] + w01 * s01[k] + w11 * s11[k];
  }
  const Eigen::Vector2i first = corner(layer, centre);
  for (int row = 0; row < size; ++row) add(layer, first.x(), first.y(), row, blended + row * size);
}

/// Sets shapes and sizes of a body's markers.
void Renderer::foreshorten(const sensor::Sensor& sensor, const sensor::Projection& project) {
  ownShapes_ = true;
  double longest = 1.0;
  for (const sensor::MarkerLayer& layer : sensor.layers) {
    const auto first = static_cast<Eigen::Index>(shapes_.size());
    const auto grid = sensor.body->markers.middleCols(first, layer.count());
    for (int i = 0; i < layer.count(); ++i) {
      const Eigen::Matrix2d seen = stretch_.cwiseInverse().asDiagonal() * project.jacobian(grid.col(i)) *
                                   tangents(grid, layer.columns, layer.rows, i % layer.columns, i / layer.columns);
      const Eigen::Vector2d axes = Eigen::JacobiSVD<Eigen::Matrix2d>(seen).singularValues();
      // y is up and v is down: what is seen from behind is not mirrored.
      const bool isSeen = seen.determinant() < 0.0 && axes[1] > kEdgeOn * axes[0];
      const double size = std::sqrt(axes.prod());
      shapes_.push_back(isSeen ? Eigen::Matrix2d(seen / size) : Eigen::Matrix2d::Identity());
      const double larger = isSeen ? 0.5 * layer.diameter * size / faceOnRadius(layer, project) : 0.0;
      diameters_[shapes_.size() - 1] *= larger;
      longest = std::max(longest, larger * axes[0] / size);
    }
  }
  longest_ *= longest;
}

/// Draws the random deviations of each marker from its layer.
void Renderer::drawVariety(const Variety& variety) {
  ownShapes_ = variety.any();
  elongation_ = variety.elongation;
  std::mt19937 generator(variety.seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double deviation) {
    return std::clamp(1.0 + deviation * normal(generator), kLeastShare, kMostShare);
  };
  for (double& diameter : diameters_) diameter = draw(variety.diameter);
  for (double& contrast : contrasts_) contrast = draw(variety.contrast);
}

void Renderer::drawOwnShape(const Layer& layer, int marker, const Eigen::Vector2d& centre) {
  const Eigen::Vector2d fromMiddle = centre - 0.5 * Eigen::Vector2d(width_ - 1, height_ - 1);
  const double toCorner = 0.5 * std::hypot(width_ - 1, height_ - 1);
  const double radius = radiusOf(layer, marker);
  if (radius == 0.0) return;
  // Along the way from the picture's middle.
  const Eigen::Matrix2d elongation =
      Eigen::Matrix2d::Identity() + elongation_ / (toCorner * toCorner) * fromMiddle * fromMiddle.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix2d> shape(
      shapes_.empty() ? elongation : Eigen::Matrix2d(elongation * shapes_[static_cast<std::size_t>(marker)]),
      Eigen::ComputeFullU);
  const Eigen::Vector2d axes = radius * shape.singularValues();
  const int left = corner(layer, centre).x(), top = corner(layer, centre).y();
  std::fill_n(patch_.begin(), layer.patch * layer.patch, 0.0F);
  const std::vector<Strip> strips =
      stretched(ellipseStrips(axes[0], axes[1], std::atan2(shape.matrixU()(1, 0), shape.matrixU()(0, 0))));
  blur_.add(strips, left - centre.x(), top - centre.y(), layer.patch, gain_ * contrasts_[marker], patch_);
  for (int row = 0; row < layer.patch; ++row) add(layer, left, top, row, patch_.data() + row * layer.patch);
}

/// Adds one row of a patch to the picture in the colours of its layer.
void Renderer::add(const Layer& layer, int left, int top, int row, const float* brightness) {
  const int v = top + row;
  if (v < 0 || v >= height_) return;
  const int end = std::min(layer.patch, width_ - left);
  for (int from = std::max(0, -left); from < end; from += kPiece) {
    addPiece(layer, left + from, v, std::min(end - from, kPiece), brightness + from);
  }
}

/// Adds at most kPiece pixels from (left, v) on, all in the picture.
void Renderer::addPiece(const Layer& layer, int left, int v, int count, const float* brightness) {
  const float down = lightDown_[v];
  const float* light = lightAcross_.data() + left;
  std::int16_t* line = light_.data() + static_cast<std::size_t>(v) * columns_;
  std::array<std::int16_t, 3 * kPiece> added;
  if (samplesPerPixel_ == 1) {
    const std::size_t cell = 2 * static_cast<std::size_t>(v % 2);
    const std::array<float, 2> weight = {layer.weight[cell_[cell]], layer.weight[cell_[cell + 1]]};
    for (int i = 0; i < count; ++i) added[i] = rounded(brightness[i] * (light[i] + down) * weight[(left + i) % 2]);
    line += left;
  } else {
    const std::size_t first = traits_->colours == tractiond::PixelColours::kBgr ? kBlue : kRed;
    const std::array<float, 3> weight = {layer.weight[first], layer.weight[kGreen], layer.weight[2 - first]};
    for (int i = 0; i < count; ++i) {
      const float value = brightness[i] * (light[i] + down);
      for (int c = 0; c < 3; ++c) added[3 * i + c] = rounded(value * weight[c]);
    }
    line += 3 * left;
    count *= 3;
  }
  for (int i = 0; i < count; ++i) line[i] = limited(line[i] + added[i]);
}

void Renderer::hideBehindNearer(const Eigen::Matrix2Xd& markers_px) {
  for (const Layer& layer : layers_) {
    for (int marker = layer.firstMarker; marker < layer.firstMarker + layer.count; ++marker) {
      const Eigen::Vector2d centre = markers_px.col(marker);
      if (!isInSight(layer, centre)) continue;
      for (const Layer& nearer : layers_) {
        if (nearer.depth <= layer.depth) continue;
        for (int other = nearer.firstMarker; other < nearer.firstMarker + nearer.count; ++other) {
          const double reach = radiusOf(layer, marker) + radiusOf(nearer, other);
          const Eigen::Vector2d apart = markers_px.col(other) - centre;
          if (!(std::abs(apart.x()) < reach * stretch_.x())) continue;
          if (apart.cwiseQuotient(stretch_).norm() < reach) {
            hide(layer, marker, centre, radiusOf(nearer, other), markers_px.col(other));
          }
        }
      }
    }
  }
}

void Renderer::hide(const Layer& layer, int marker, const Eigen::Vector2d& centre_px, double nearerRadius,
                    const Eigen::Vector2d& nearer_px) {
  const double radius_px = radiusOf(layer, marker);
  // In coordinates in which the discs are round.
  const Eigen::Vector2d centre = centre_px.cwiseQuotient(stretch_), nearer = nearer_px.cwiseQuotient(stretch_);
  const double bottom = std::max(centre.y() - radius_px, nearer.y() - nearerRadius);
  const double height = std::min(centre.y() + radius_px, nearer.y() + nearerRadius) - bottom;
  const int size = layer.patch;
  const int left = corner(layer, centre_px).x(), top = corner(layer, centre_px).y();
  std::fill_n(patch_.begin(), size * size, 0.0F);
  const int strips = std::max(kLeastLensStrips, static_cast<int>(kLensStripsPerPixel * height));
  for (int i = 0; i < strips; ++i) {
    const double y = bottom + (i + 0.5) / strips * height;
    const auto halfWidth = [y](double radius, const Eigen::Vector2d& c) {
      return std::sqrt(std::max(0.0, radius * radius - (y - c.y()) * (y - c.y())));
    };
    const double own = halfWidth(radius_px, centre), other = halfWidth(nearerRadius, nearer);
    const double x0 = std::max(centre.x() - own, nearer.x() - other);
    const double x1 = std::min(centre.x() + own, nearer.x() + other);
    const Strip strip = stretched({y, height / strips, x0, std::max(x0, x1)});
    blur_.add(std::span(&strip, 1), left, top, size, -gain_ * contrasts_[marker], patch_);
  }
  for (int row = 0; row < size; ++row) add(layer, left, top, row, patch_.data() + row * size);
}

/// Adds noise and converts units to steps of the format: 2^kDown units per step, or 2^kUp steps per unit. 255 levels
/// are the brightest step of an 8-bit picture.
template <int kDown, int kUp, typename Sample>
void Renderer::addNoise(std::uint32_t seed, std::span<Sample> picture) {
  constexpr int kMost = kUp > 0 ? 65535 : (256 << (6 - kDown)) - 1;
  const std::size_t columns = columns_;
  const auto perLevel = static_cast<float>(shotNoise_ * kUnits);  // variance in units^2 per unit of light
  const auto fixed = static_cast<float>(readNoise_ * readNoise_ * kUnits * kUnits);
  for (int v = 0; v < height_; ++v) {
    const std::uint64_t random = scrambled(std::uint64_t{seed} << 32U | static_cast<std::uint32_t>(v));
    const std::int16_t* noise = noise_.data() + random % kNoiseCount;
    const std::int16_t* light = light_.data() + static_cast<std::size_t>(v) * columns;
    Sample* line = picture.data() + static_cast<std::size_t>(v) * columns;
    // Rounding of half steps alternates at random, so that it is unbiased on average.
    const int half = kDown > 0 ? (1 << kDown) / 2 - static_cast<int>(random >> 63U) : 0;
    if (perLevel > 0.0F) {
      for (std::size_t i = 0; i < columns; ++i) {
        const float deviation = std::sqrt(fixed + perLevel * static_cast<float>(light[i]));
        const int units = light[i] + static_cast<int>(deviation * static_cast<float>(noise[i]) * (1.0F / kDeviation));
        line[i] = static_cast<Sample>(std::clamp((units + half) * (1 << kUp) >> kDown, 0, kMost));
      }
    } else {
      for (std::size_t i = 0; i < columns; ++i) {
        if constexpr (kUp == 0) {
          const auto units = static_cast<std::int16_t>(light[i] + noise[i] + half);
          line[i] = static_cast<Sample>(std::clamp<std::int16_t>(static_cast<std::int16_t>(units >> kDown), 0, kMost));
        } else {
          line[i] = static_cast<Sample>(std::clamp((light[i] + noise[i]) * (1 << kUp), 0, kMost));
        }
      }
    }
  }
}

}  // namespace twin

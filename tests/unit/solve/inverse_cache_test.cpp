#include "daemon/solve/inverse_cache.h"
#include "daemon/solve/inverse_file.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace tractiond::solve::inverse_cache_test {
namespace {

namespace fs = std::filesystem;

/// So few that every byte of the file can be tried.
sensor::Sensor tinySensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 2;
  sensor.nodes.columns = sensor.nodes.rows = 2;
  sensor.uncertainty.markerDepth = 0.1e-3;
  return sensor;
}

/// What differs between the two kinds of content.
template <typename Content>
struct Kind;

template <>
struct Kind<Inverse> {
  static constexpr const char* kExtension = ".inverse";
  static auto obtain(const sensor::Sensor& sensor, const SolveOptions& options, const fs::path& state,
                     const sensor::elastic::Progress& progress, const Remark& remark) {
    return loadOrCompute(sensor, options, state, progress, remark);
  }
  static Id id(const sensor::Sensor& sensor, const SolveOptions& options) { return inverseId(sensor, options); }
  static fs::path path(const fs::path& state, const Id& id) { return cachePath(state, id); }
  static auto load(const fs::path& path, const Id& id, const sensor::Sensor& sensor) {
    return loadInverse(path, id, 2 * sensor.markerCount(), 3 * sensor.nodes.count());
  }
  static void expectSame(const Inverse& a, const Inverse& b) {
    EXPECT_EQ(a.lambda, b.lambda);
    EXPECT_EQ(a.hat, b.hat);
    EXPECT_EQ(a.motionGain, b.motionGain);
    EXPECT_EQ(a.motionVariance, b.motionVariance);
  }
};

template <>
struct Kind<Factors> {
  static constexpr const char* kExtension = ".factors";
  static auto obtain(const sensor::Sensor& sensor, const SolveOptions& options, const fs::path& state,
                     const sensor::elastic::Progress& progress, const Remark& remark) {
    return loadOrComputeFactors(sensor, makeAtoms(sensor), options, state, progress, remark);
  }
  static Id id(const sensor::Sensor& sensor, const SolveOptions& options) { return factorsId(sensor, options); }
  static fs::path path(const fs::path& state, const Id& id) { return factorsPath(state, id); }
  static auto load(const fs::path& path, const Id& id, const sensor::Sensor& sensor) {
    return loadFactors(path, id, 2 * sensor.markerCount(), makeAtoms(sensor));
  }
  static void expectSame(const Factors& a, const Factors& b) {
    EXPECT_EQ(a.force_N, b.force_N);
    EXPECT_EQ(a.motionGain, b.motionGain);
    EXPECT_EQ(a.motionCoupling, b.motionCoupling);
    EXPECT_EQ(a.motionGram, b.motionGram);
  }
};

template <typename Content>
class InverseCache : public testing::Test {
 protected:
  using Of = Kind<Content>;

  InverseCache() {
    std::string name = (fs::temp_directory_path() / "inverse-cache-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    directory_ = name;
    options_.model = sensor::elastic::Model::kHalfSpace;
  }
  ~InverseCache() override { fs::remove_all(directory_); }

  /// What the cache gives, remembering what it says.
  Content obtain(const SolveOptions& options) {
    remarks_.clear();
    computed_ = false;
    auto content = Of::obtain(
        sensor_, options, state(), [this](double) { computed_ = true; },
        [this](const std::string& remark) { remarks_.push_back(remark); });
    EXPECT_TRUE(content.has_value());
    return std::move(*content);
  }
  Content obtain() { return obtain(options_); }
  SolveOptions noisier(int times) const {
    SolveOptions options = options_;
    options.noise_px *= times;
    return options;
  }

  fs::path state() const { return directory_ / "state"; }
  fs::path file(const SolveOptions& options) const { return Of::path(state(), Of::id(sensor_, options)); }
  fs::path file() const { return file(options_); }

  std::vector<char> content() const {
    std::ifstream stream(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void overwrite(const std::vector<char>& bytes) const {
    std::ofstream(file(), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  auto load() const { return Of::load(file(), Of::id(sensor_, options_), sensor_); }

  /// Every byte of the header and of small files, some of large ones.
  static std::size_t next(std::size_t byte, std::size_t size) { return byte + (byte < 200 || size < 20'000 ? 1 : 101); }

  void spoil(const char* reason, const std::vector<char>& bytes) {
    overwrite(bytes);
    obtain();
    EXPECT_TRUE(computed_);
    ASSERT_EQ(remarks_.size(), 1U);
    EXPECT_NE(remarks_[0].find(file().string()), std::string::npos) << remarks_[0];
    EXPECT_NE(remarks_[0].find(reason), std::string::npos) << remarks_[0];
    EXPECT_TRUE(load()) << "replaced";
  }

  fs::path directory_;
  const sensor::Sensor sensor_ = tinySensor();
  SolveOptions options_;
  std::vector<std::string> remarks_;
  bool computed_ = false;
};

using Contents = testing::Types<Inverse, Factors>;
TYPED_TEST_SUITE(InverseCache, Contents);

TYPED_TEST(InverseCache, TheSecondStartReadsWhatTheFirstComputed) {
  const TypeParam first = this->obtain();
  EXPECT_TRUE(this->computed_);
  EXPECT_EQ(first.id, Kind<TypeParam>::id(this->sensor_, this->options_));
  EXPECT_GT(first.computed_ns, 0);
  const TypeParam second = this->obtain();
  EXPECT_FALSE(this->computed_);
  EXPECT_TRUE(this->remarks_.empty());
  EXPECT_EQ(first.id, second.id);
  EXPECT_EQ(first.computed_ns, second.computed_ns);
  EXPECT_EQ(first.singularValues, second.singularValues);
  EXPECT_TRUE(std::ranges::equal(first.left.all(), second.left.all()));
  EXPECT_TRUE(std::ranges::equal(first.right.all(), second.right.all()));
  EXPECT_TRUE(std::ranges::equal(first.influence.all(), second.influence.all()));
  EXPECT_TRUE(std::ranges::equal(first.motion.all(), second.motion.all()));
  EXPECT_EQ(first.gram, second.gram);
  EXPECT_EQ(first.systematicErrors.contact, second.systematicErrors.contact);
  EXPECT_EQ(first.systematicErrors.wholeFace, second.systematicErrors.wholeFace);
  EXPECT_NE(first.systematicErrors.contact, first.systematicErrors.wholeFace);
  EXPECT_EQ(first.systematicErrors.contactScatter, second.systematicErrors.contactScatter);
  EXPECT_EQ(first.systematicErrors.wholeFaceScatter, second.systematicErrors.wholeFaceScatter);
  EXPECT_FALSE(first.systematicErrors.contactScatter.empty());
  Kind<TypeParam>::expectSame(first, second);
  EXPECT_EQ(std::distance(fs::directory_iterator(this->state()), {}), 1) << "nothing is left beside the cache";
}

TYPED_TEST(InverseCache, AnyChangedByteIsNoticed) {
  this->obtain();
  const std::vector<char> whole = this->content();
  std::fstream stream(this->file(), std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&stream](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  for (std::size_t i = 0; i < whole.size(); i = this->next(i, whole.size())) {
    put(i, static_cast<char>(whole[i] ^ 0x10));
    ASSERT_FALSE(this->load()) << "byte " << i;
    put(i, whole[i]);
  }
  EXPECT_TRUE(this->load());
}

TYPED_TEST(InverseCache, AnyOtherLengthIsNoticed) {
  this->obtain();
  const std::vector<char> whole = this->content();
  ASSERT_TRUE(this->load());
  fs::resize_file(this->file(), whole.size() + 1);
  EXPECT_FALSE(this->load());
  for (std::size_t length = whole.size(); length > 0;) {
    length -= std::min(length, this->next(length, whole.size()) - length);
    fs::resize_file(this->file(), length);
    ASSERT_FALSE(this->load()) << "length " << length;
  }
}

TYPED_TEST(InverseCache, ASpoiltFileIsReplacedAndTheReasonTold) {
  this->obtain();
  const std::vector<char> whole = this->content();
  std::vector<char> version = whole, flipped = whole;
  version[8] = static_cast<char>(version[8] + 1);
  flipped.back() = static_cast<char>(flipped.back() + 1);
  this->spoil("not a cached inverse", std::vector<char>(whole.size(), 'x'));
  this->spoil("another version", version);
  this->spoil("checksum", {whole.begin(), whole.end() - 1});
  this->spoil("checksum", flipped);
  this->spoil("shorter than its header", {});
}

TYPED_TEST(InverseCache, AnotherSensorsFileUnderThisNameIsRefused) {
  const SolveOptions other = this->noisier(2);
  this->obtain(other);
  fs::rename(this->file(other), this->file());
  EXPECT_EQ(this->load().error(), this->file().string() + ": of another sensor");
  this->obtain();
  EXPECT_TRUE(this->computed_);
}

TYPED_TEST(InverseCache, AFileThatCannotBeReadIsARemark) {
  fs::create_directories(this->file());
  this->obtain();
  EXPECT_TRUE(this->computed_);
  EXPECT_EQ(this->remarks_.size(), 2U) << "neither read nor written";
}

TYPED_TEST(InverseCache, AStateDirectoryThatCannotBeWrittenIsARemark) {
  std::ofstream(this->state()) << "a file where the directory should be";
  this->obtain();
  EXPECT_TRUE(this->computed_);
  ASSERT_EQ(this->remarks_.size(), 2U);
  EXPECT_NE(this->remarks_[1].find("not cached"), std::string::npos);
}

TYPED_TEST(InverseCache, KeepsTheNewestFour) {
  const std::string extension = Kind<TypeParam>::kExtension;
  std::vector<fs::path> files;
  for (int i = 0; i < 6; ++i) {
    const SolveOptions options = this->noisier(i + 1);
    this->obtain(options);
    files.push_back(this->file(options));
    fs::last_write_time(files.back(), fs::file_time_type::clock::now() - std::chrono::hours(6 - i));
  }
  const std::vector<fs::path> others = {this->state() / "rest.pose", this->state() / "other.inverse-not"};
  for (const fs::path& other : others) std::ofstream(other) << "not ours";
  std::ofstream(this->state() / ("abandoned" + extension + ".unfinished")) << "by a kill";
  this->obtain();  // as the first, which was deleted
  EXPECT_TRUE(this->computed_);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(fs::exists(files[i]), i == 0 || i > 2) << i;
  EXPECT_FALSE(fs::exists(this->state() / ("abandoned" + extension + ".unfinished")));
  for (const fs::path& other : others) EXPECT_TRUE(fs::exists(other)) << other;
}

/// The ids, for one sensor and options each.
class CacheId : public testing::Test {
 protected:
  const sensor::Sensor sensor_ = tinySensor();
  const SolveOptions options_;
};

TEST_F(CacheId, DependsOnEverythingTheNumbersDependOn) {
  std::vector<Id> ids, factorIds;
  const auto changed = [&](auto change) {
    sensor::Sensor sensor = sensor_;
    SolveOptions options = options_;
    change(sensor, options);
    ids.push_back(inverseId(sensor, options));
    factorIds.push_back(factorsId(sensor, options));
  };
  using sensor::Sensor;
  changed([](Sensor&, SolveOptions&) {});
  changed([](Sensor& s, SolveOptions&) { s.gel.youngsModulus *= 1.01; });
  changed([](Sensor& s, SolveOptions&) { s.gel.poissonRatio = 0.48; });
  changed([](Sensor& s, SolveOptions&) { s.gel.size.x() += 1e-3; });
  changed([](Sensor& s, SolveOptions&) { s.gel.size.z() += 1e-3; });
  changed([](Sensor& s, SolveOptions&) { s.layers[0].depth += 1e-3; });
  changed([](Sensor& s, SolveOptions&) { s.layers[1].pitch += 1e-4; });
  changed([](Sensor& s, SolveOptions&) { s.layers[1].centre.x() += 1e-4; });
  changed([](Sensor& s, SolveOptions&) { s.layers[1].rows += 1; });
  changed([](Sensor& s, SolveOptions&) { s.nodes.pitch += 1e-4; });
  changed([](Sensor& s, SolveOptions&) { s.nodes.columns += 1; });
  changed([](Sensor& s, SolveOptions&) { s.camera.focal_px += 1.0; });
  changed([](Sensor& s, SolveOptions&) { s.camera.aspect = 1.035; });
  changed([](Sensor& s, SolveOptions&) { s.camera.principal_px.y() += 1.0; });
  changed([](Sensor& s, SolveOptions&) { s.camera.k1 = 0.1; });
  changed([](Sensor& s, SolveOptions&) { s.camera.k2 = 0.1; });
  changed([](Sensor& s, SolveOptions&) { s.camera.position.z() += 1e-3; });
  changed([](Sensor& s, SolveOptions&) { s.camera.rotation.x() = 0.01; });
  changed([](Sensor& s, SolveOptions&) { s.camera.gelIndex = 1.41; });
  changed([](Sensor& s, SolveOptions&) { s.camera.windowIndex = 1.49; });
  changed([](Sensor& s, SolveOptions&) { s.camera.windowThickness = 5e-3; });
  changed([](Sensor&, SolveOptions& o) { o.model = sensor::elastic::Model::kHalfSpace; });
  changed([](Sensor&, SolveOptions& o) { o.noise_px *= 2.0; });
  std::sort(factorIds.begin(), factorIds.end());
  EXPECT_EQ(std::adjacent_find(factorIds.begin(), factorIds.end()), factorIds.end());
  changed([](Sensor&, SolveOptions& o) { o.regularisation *= 2.0; });
  changed([](Sensor&, SolveOptions& o) { o.truncation *= 2.0; });
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

TEST_F(CacheId, DoesNotDependOnTheRest) {
  sensor::Sensor sensor = sensor_;
  SolveOptions options = options_;
  sensor.layers[0].diameter *= 2.0;
  sensor.camera.width *= 2;
  options.maxMissingFraction = 0.1;
  options.minPressForCentre_N = 1.0;
  EXPECT_EQ(inverseId(sensor, options), inverseId(sensor_, options_));
  EXPECT_EQ(factorsId(sensor, options), factorsId(sensor_, options_));
  EXPECT_NE(factorsId(sensor, options), inverseId(sensor_, options_));
}

}  // namespace
}  // namespace tractiond::solve::inverse_cache_test

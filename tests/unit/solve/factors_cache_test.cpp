#include "daemon/solve/factors_cache.h"
#include "daemon/solve/factors_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace tractiond::solve::factors_cache_test {
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

class FactorsCache : public testing::Test {
 protected:
  FactorsCache() { options_.model = sensor::elastic::Model::kHalfSpace; }

  /// What the cache gives, remembering what it says.
  Factors obtain(const SolveOptions& options) {
    remarks_.clear();
    steps_.clear();
    const auto noteStep = [this](Step step, double) {
      if (steps_.empty() || steps_.back() != step) steps_.push_back(step);
    };
    auto content = loadOrComputeFactors(sensor_, makeAtoms(sensor_), options, state(), noteStep,
                                        [this](const std::string& remark) { remarks_.push_back(remark); });
    EXPECT_TRUE(content.has_value());
    return std::move(*content);
  }
  Factors obtain() { return obtain(options_); }
  SolveOptions noisier(int times) const {
    SolveOptions options = options_;
    options.noise_px *= times;
    return options;
  }

  fs::path state() const { return directory_.path() / "state"; }
  fs::path file(const SolveOptions& options) const { return cachePath(state(), calibrationId(sensor_, options)); }
  fs::path file() const { return file(options_); }

  std::vector<char> content() const {
    std::ifstream stream(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void overwrite(const std::vector<char>& bytes) const {
    std::ofstream(file(), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  auto load() const {
    return loadFactors(file(), calibrationId(sensor_, options_), 2 * sensor_.markerCount(), makeAtoms(sensor_));
  }

  /// Every byte of the header and of small files, some of large ones.
  static std::size_t next(std::size_t byte, std::size_t size) { return byte + (byte < 200 || size < 20'000 ? 1 : 101); }

  void spoil(const char* reason, const std::vector<char>& bytes) {
    overwrite(bytes);
    obtain();
    EXPECT_FALSE(steps_.empty());
    ASSERT_EQ(remarks_.size(), 1U);
    EXPECT_NE(remarks_[0].find(file().string()), std::string::npos) << remarks_[0];
    EXPECT_NE(remarks_[0].find(reason), std::string::npos) << remarks_[0];
    EXPECT_TRUE(load()) << "replaced";
  }

  const test::TemporaryFolder directory_;
  const sensor::Sensor sensor_ = tinySensor();
  SolveOptions options_;
  std::vector<std::string> remarks_;
  std::vector<Step> steps_;
};

TEST_F(FactorsCache, TheSecondStartReadsWhatTheFirstComputed) {
  const Factors first = obtain();
  EXPECT_EQ(steps_, (std::vector{Step::kInfluence, Step::kProducts, Step::kModes, Step::kSystematicErrors}));
  EXPECT_EQ(first.id, calibrationId(sensor_, options_));
  EXPECT_GT(first.computed_ns, 0);
  const Factors second = obtain();
  EXPECT_TRUE(steps_.empty());
  EXPECT_TRUE(remarks_.empty());
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
  EXPECT_EQ(first.force_N, second.force_N);
  EXPECT_EQ(first.motionGain, second.motionGain);
  EXPECT_EQ(first.motionCoupling, second.motionCoupling);
  EXPECT_EQ(first.motionGram, second.motionGram);
  EXPECT_EQ(std::distance(fs::directory_iterator(state()), {}), 1) << "nothing is left beside the cache";
}

TEST_F(FactorsCache, AnyChangedByteIsNoticed) {
  obtain();
  const std::vector<char> whole = content();
  std::fstream stream(file(), std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&stream](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  for (std::size_t i = 0; i < whole.size(); i = next(i, whole.size())) {
    put(i, static_cast<char>(whole[i] ^ 0x10));
    ASSERT_FALSE(load()) << "byte " << i;
    put(i, whole[i]);
  }
  EXPECT_TRUE(load());
}

TEST_F(FactorsCache, ASpoiltFileIsReplacedAndTheReasonTold) {
  obtain();
  const std::vector<char> whole = content();
  std::vector<char> version = whole, flipped = whole;
  version[8] = static_cast<char>(version[8] + 1);
  flipped.back() = static_cast<char>(flipped.back() + 1);
  spoil("not a file of factors", std::vector<char>(whole.size(), 'x'));
  spoil("another version", version);
  spoil("checksum", {whole.begin(), whole.end() - 1});
  spoil("checksum", flipped);
  spoil("shorter than its header", {});
}

TEST_F(FactorsCache, AnotherSensorsFileUnderThisNameIsRefused) {
  const SolveOptions other = noisier(2);
  obtain(other);
  fs::rename(file(other), file());
  EXPECT_EQ(load().error(), file().string() + ": of another sensor");
  obtain();
  EXPECT_FALSE(steps_.empty());
}

TEST_F(FactorsCache, AStateDirectoryThatCannotBeWrittenIsARemark) {
  std::ofstream(state()) << "a file where the directory should be";
  obtain();
  EXPECT_FALSE(steps_.empty());
  ASSERT_EQ(remarks_.size(), 2U);
  EXPECT_NE(remarks_[1].find("not cached"), std::string::npos);
}

TEST_F(FactorsCache, KeepsTheNewestFour) {
  std::vector<fs::path> files;
  for (int i = 0; i < 6; ++i) {
    const SolveOptions options = noisier(i + 1);
    obtain(options);
    files.push_back(file(options));
    fs::last_write_time(files.back(), fs::file_time_type::clock::now() - std::chrono::hours(6 - i));
  }
  const std::vector<fs::path> others = {state() / "rest.pose", state() / "other.factors-not"};
  for (const fs::path& other : others) std::ofstream(other) << "not ours";
  std::ofstream(state() / "abandoned.factors.unfinished") << "by a kill";
  obtain();  // as the first, which was deleted
  EXPECT_FALSE(steps_.empty());
  for (int i = 0; i < 6; ++i) EXPECT_EQ(fs::exists(files[i]), i == 0 || i > 2) << i;
  EXPECT_FALSE(fs::exists(state() / "abandoned.factors.unfinished"));
  for (const fs::path& other : others) EXPECT_TRUE(fs::exists(other)) << other;
}

class CalibrationId : public testing::Test {
 protected:
  const sensor::Sensor sensor_ = tinySensor();
  const SolveOptions options_;
};

TEST_F(CalibrationId, DependsOnEverythingTheNumbersDependOn) {
  std::vector<Id> ids;
  const auto changed = [&](auto change) {
    sensor::Sensor sensor = sensor_;
    SolveOptions options = options_;
    change(sensor, options);
    ids.push_back(calibrationId(sensor, options));
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
  changed([](Sensor& s, SolveOptions&) { s.camera.fisheye = true; });
  changed([](Sensor& s, SolveOptions&) { s.camera.fisheye = true, s.camera.k3 = 0.1; });
  changed([](Sensor& s, SolveOptions&) { s.camera.fisheye = true, s.camera.k4 = 0.1; });
  changed([](Sensor& s, SolveOptions&) { s.camera.position.z() += 1e-3; });
  changed([](Sensor& s, SolveOptions&) { s.camera.rotation.x() = 0.01; });
  changed([](Sensor& s, SolveOptions&) { s.camera.gelIndex = 1.41; });
  changed([](Sensor& s, SolveOptions&) { s.camera.windowIndex = 1.49; });
  changed([](Sensor& s, SolveOptions&) { s.camera.windowThickness = 5e-3; });
  changed([](Sensor& s, SolveOptions&) { s.camera.surfaces = {{.centre = {0, 0, 60e-3}}}; });
  changed([](Sensor&, SolveOptions& o) { o.model = sensor::elastic::Model::kHalfSpace; });
  changed([](Sensor&, SolveOptions& o) { o.noise_px *= 2.0; });
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

TEST_F(CalibrationId, DoesNotDependOnTheRest) {
  sensor::Sensor sensor = sensor_;
  SolveOptions options = options_;
  sensor.layers[0].diameter *= 2.0;
  sensor.camera.width *= 2;
  options.maxMissingFraction = 0.1;
  options.minPressForCentre_N = 1.0;
  EXPECT_EQ(calibrationId(sensor, options), calibrationId(sensor_, options_));
}

}  // namespace
}  // namespace tractiond::solve::factors_cache_test

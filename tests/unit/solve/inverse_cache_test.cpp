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
  return sensor;
}

class InverseCache : public testing::Test {
 protected:
  InverseCache() {
    std::string name = (fs::temp_directory_path() / "inverse-cache-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    directory_ = name;
    options_.model = sensor::elastic::Model::kHalfSpace;
  }
  ~InverseCache() override { fs::remove_all(directory_); }

  /// What loadOrCompute() gives, remembering what it says.
  Inverse obtain(const SolveOptions& options) {
    remarks_.clear();
    computed_ = false;
    auto inverse = loadOrCompute(
        sensor_, options, state(), [this](double) { computed_ = true; },
        [this](const std::string& remark) { remarks_.push_back(remark); });
    EXPECT_TRUE(inverse.has_value());
    return std::move(*inverse);
  }
  Inverse obtain() { return obtain(options_); }

  fs::path state() const { return directory_ / "state"; }
  fs::path file() const { return cachePath(state(), inverseId(sensor_, options_)); }

  std::vector<char> content() const {
    std::ifstream stream(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void overwrite(const std::vector<char>& bytes) const {
    std::ofstream(file(), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  auto load() const {
    return loadInverse(file(), inverseId(sensor_, options_), 2 * sensor_.markerCount(), 3 * sensor_.nodes.count());
  }

  static void expectSame(const Inverse& a, const Inverse& b) {
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.computed_ns, b.computed_ns);
    EXPECT_EQ(a.lambda, b.lambda);
    EXPECT_EQ(a.singularValues, b.singularValues);
    EXPECT_TRUE(std::ranges::equal(a.left.all(), b.left.all()));
    EXPECT_TRUE(std::ranges::equal(a.right.all(), b.right.all()));
    EXPECT_EQ(a.hat, b.hat);
    EXPECT_EQ(a.systematicErrors.contact, b.systematicErrors.contact);
    EXPECT_EQ(a.systematicErrors.wholeFace, b.systematicErrors.wholeFace);
    EXPECT_NE(a.systematicErrors.contact, a.systematicErrors.wholeFace);
  }

  fs::path directory_;
  const sensor::Sensor sensor_ = tinySensor();
  SolveOptions options_;
  std::vector<std::string> remarks_;
  bool computed_ = false;
};

TEST_F(InverseCache, TheSecondStartReadsWhatTheFirstComputed) {
  const Inverse first = obtain();
  EXPECT_TRUE(computed_);
  EXPECT_EQ(first.id, inverseId(sensor_, options_));
  EXPECT_GT(first.computed_ns, 0);
  const Inverse second = obtain();
  EXPECT_FALSE(computed_);
  EXPECT_TRUE(remarks_.empty());
  expectSame(first, second);
  EXPECT_EQ(std::distance(fs::directory_iterator(state()), {}), 1) << "nothing is left beside the cache";
}

TEST_F(InverseCache, AnyChangedByteIsNoticed) {
  obtain();
  const std::vector<char> whole = content();
  std::fstream stream(file(), std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&stream](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  for (std::size_t i = 0; i < whole.size(); ++i) {
    put(i, static_cast<char>(whole[i] ^ 0x10));
    ASSERT_FALSE(load()) << "byte " << i;
    put(i, whole[i]);
  }
  EXPECT_TRUE(load());
}

TEST_F(InverseCache, AnyOtherLengthIsNoticed) {
  obtain();
  const std::uintmax_t length = fs::file_size(file());
  ASSERT_TRUE(load());
  fs::resize_file(file(), length + 1);
  EXPECT_FALSE(load());
  for (std::uintmax_t shorter = length; shorter-- > 0;) {
    fs::resize_file(file(), shorter);
    ASSERT_FALSE(load()) << "length " << shorter;
  }
}

TEST_F(InverseCache, ASpoiltFileIsReplacedAndTheReasonTold) {
  const auto spoil = [this](const char* reason, const std::vector<char>& bytes) {
    overwrite(bytes);
    obtain();
    EXPECT_TRUE(computed_);
    ASSERT_EQ(remarks_.size(), 1U);
    EXPECT_NE(remarks_[0].find(file().string()), std::string::npos) << remarks_[0];
    EXPECT_NE(remarks_[0].find(reason), std::string::npos) << remarks_[0];
    EXPECT_TRUE(load()) << "replaced";
  };
  obtain();
  const std::vector<char> whole = content();
  std::vector<char> version = whole, flipped = whole;
  version[8] = static_cast<char>(version[8] + 1);
  flipped.back() = static_cast<char>(flipped.back() + 1);
  spoil("not a cached inverse", std::vector<char>(whole.size(), 'x'));
  spoil("another version", version);
  spoil("checksum", {whole.begin(), whole.end() - 1});
  spoil("checksum", flipped);
  spoil("shorter than its header", {});
}

TEST_F(InverseCache, AnotherSensorsFileUnderThisNameIsRefused) {
  SolveOptions other = options_;
  other.regularisation *= 2.0;
  obtain(other);
  fs::rename(cachePath(state(), inverseId(sensor_, other)), file());
  EXPECT_EQ(load().error(), file().string() + ": of another sensor");
  obtain();
  EXPECT_TRUE(computed_);
}

TEST_F(InverseCache, AFileThatCannotBeReadIsARemark) {
  fs::create_directories(file());
  obtain();
  EXPECT_TRUE(computed_);
  EXPECT_EQ(remarks_.size(), 2U) << "neither read nor written";
}

TEST_F(InverseCache, AStateDirectoryThatCannotBeWrittenIsARemark) {
  std::ofstream(state()) << "a file where the directory should be";
  obtain();
  EXPECT_TRUE(computed_);
  ASSERT_EQ(remarks_.size(), 2U);
  EXPECT_NE(remarks_[1].find("not cached"), std::string::npos);
}

TEST_F(InverseCache, KeepsTheNewestFour) {
  std::vector<fs::path> files;
  for (int i = 0; i < 6; ++i) {
    SolveOptions options = options_;
    options.regularisation = 1e-3 * (i + 1);
    obtain(options);
    files.push_back(cachePath(state(), inverseId(sensor_, options)));
    fs::last_write_time(files.back(), fs::file_time_type::clock::now() - std::chrono::hours(6 - i));
  }
  std::ofstream(state() / "abandoned.inverse.unfinished") << "by a kill";
  std::ofstream(state() / "rest.pose") << "not ours";
  obtain();  // as the first, which was deleted
  EXPECT_TRUE(computed_);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(fs::exists(files[i]), i == 0 || i > 2) << i;
  EXPECT_FALSE(fs::exists(state() / "abandoned.inverse.unfinished"));
  EXPECT_TRUE(fs::exists(state() / "rest.pose"));
}

TEST_F(InverseCache, TheIdDependsOnEverythingTheNumbersDependOn) {
  std::vector<Id> ids = {inverseId(sensor_, options_)};
  const auto changed = [&](auto change) {
    sensor::Sensor sensor = sensor_;
    SolveOptions options = options_;
    change(sensor, options);
    ids.push_back(inverseId(sensor, options));
  };
  using sensor::Sensor;
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
  changed([](Sensor&, SolveOptions& o) { o.model = sensor::elastic::Model::kBlock; });
  changed([](Sensor&, SolveOptions& o) { o.regularisation *= 2.0; });
  changed([](Sensor&, SolveOptions& o) { o.truncation *= 2.0; });
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

TEST_F(InverseCache, TheIdDoesNotDependOnTheRest) {
  sensor::Sensor sensor = sensor_;
  SolveOptions options = options_;
  sensor.layers[0].diameter *= 2.0;
  sensor.camera.width *= 2;
  options.maxMissingFraction = 0.1;
  options.minPressForCentre_N = 1.0;
  EXPECT_EQ(inverseId(sensor, options), inverseId(sensor_, options_));
}

}  // namespace
}  // namespace tractiond::solve::inverse_cache_test

#include "sensor/gel_file.h"
#include "sensor/influence_file.h"
#include "tests/support/npz.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

namespace {

using npz::Member;
using sensor::Body;
using tractiond::FileError;

constexpr int kMarkers = 4, kNodes = 6;  // 2 x 2 and 3 x 2

std::vector<double> counted(int count, double step = 1e-3) {
  std::vector<double> values(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = step * static_cast<double>(i + 1);
  return values;
}

std::vector<double> inward() {
  std::vector<double> normals;
  for (int n = 0; n < kNodes; ++n) normals.insert(normals.end(), {0.0, 0.6, 0.8});
  return normals;
}

/// A whole file of 2 x 2 markers and 3 x 2 nodes.
std::vector<Member> whole() {
  return {
      {"format", npz::text("traction-influence/1")},
      {"units", npz::text("SI")},
      {"youngs_modulus", npz::numbers("", {2e3})},
      {"influence", npz::numbers("4, 3, 6, 3", counted(9 * kMarkers * kNodes))},
      {"node_positions", npz::numbers("6, 3", counted(3 * kNodes))},
      {"node_normals", npz::numbers("6, 3", inward())},
      {"node_areas", npz::numbers("6,", counted(kNodes, 1e-6))},
      {"marker_positions", npz::numbers("4, 3", counted(3 * kMarkers))},
  };
}

std::vector<Member> with(const std::string& name, const std::string& content) {
  std::vector<Member> members = whole();
  for (Member& member : members) {
    if (member.name == name) member.content = content;
  }
  return members;
}

class InfluenceFile : public testing::Test {
 protected:
  InfluenceFile() { std::filesystem::create_directories(folder_); }
  ~InfluenceFile() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& bytes, const std::string& name = "body.npz") {
    const std::filesystem::path path = folder_ / name;
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  tl::expected<Body, FileError> load(const std::vector<Member>& members) {
    return sensor::loadBody(write(npz::archive(members)));
  }
  /// What is wrong, after the path.
  std::string fault(const std::vector<Member>& members) {
    const auto loaded = load(members);
    if (loaded) return "";
    EXPECT_TRUE(loaded.error().isData);
    EXPECT_EQ(loaded.error().where, folder_ / "body.npz");
    return loaded.error().what;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      ("influence_file_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + "_" +
       std::to_string(getpid()));
};

void expectWhole(const Body& body) {
  EXPECT_EQ(body.youngsModulus, 2e3);
  ASSERT_EQ(body.influence.rows(), 3 * kMarkers);
  ASSERT_EQ(body.influence.cols(), 3 * kNodes);
  for (int i = 0; i < 3 * kMarkers; ++i) {
    for (int j = 0; j < 3 * kNodes; ++j) EXPECT_NEAR(body.influence(i, j), 1e-3 * (3 * kNodes * i + j + 1), 1e-7);
  }
  ASSERT_EQ(body.nodes.cols(), kNodes);
  EXPECT_NEAR(body.nodes(2, 1), 6e-3, 1e-9);
  EXPECT_TRUE(body.normals.col(5).isApprox(Eigen::Vector3d(0.0, 0.6, 0.8)));
  EXPECT_NEAR(body.areas[5], 6e-6, 1e-12);
  ASSERT_EQ(body.markers.cols(), kMarkers);
  EXPECT_NEAR(body.markers(0, 3), 10e-3, 1e-9);
}

TEST_F(InfluenceFile, IsReadAsItWasWritten) {
  const auto body = load(whole());
  ASSERT_TRUE(body) << body.error().what;
  expectWhole(*body);
  EXPECT_EQ(body->file, folder_ / "body.npz");
}

TEST_F(InfluenceFile, ErrorsAreReadWhereThereAreAny) {
  EXPECT_TRUE(load(whole())->errors.empty());
  std::vector<Member> members = whole();
  members.push_back({"influence_errors", npz::numbers("2, 4, 3, 6, 3", counted(2 * 9 * kMarkers * kNodes))});
  const auto body = load(members);
  ASSERT_TRUE(body) << body.error().what;
  ASSERT_EQ(body->errors.size(), 2U);
  EXPECT_EQ(body->errors[0], body->influence);
  EXPECT_NEAR(body->errors[1](2, 5), 1e-3 * (9 * kMarkers * kNodes + 3 * kNodes * 2 + 6), 1e-12);
  members.back().content = npz::numbers("4, 3, 6, 3", counted(9 * kMarkers * kNodes));
  EXPECT_EQ(fault(members), "influence_errors has the shape (4, 3, 6, 3) and not (4, 4, 3, 6, 3)");
}

TEST_F(InfluenceFile, MatrixMayBeFlatSingleOrInFortranOrder) {
  const std::vector<double> values = counted(9 * kMarkers * kNodes);
  const std::vector<float> single(values.begin(), values.end());
  std::vector<double> flat, deep;
  for (int j = 0; j < 3 * kNodes; ++j) {
    for (int i = 0; i < 3 * kMarkers; ++i) flat.push_back(values[3 * kNodes * i + j]);
  }
  for (int b = 0; b < 3; ++b) {
    for (int n = 0; n < kNodes; ++n) {
      for (int a = 0; a < 3; ++a) {
        for (int m = 0; m < kMarkers; ++m) deep.push_back(values[((3 * m + a) * kNodes + n) * 3 + b]);
      }
    }
  }
  for (const std::string& content :
       {npz::numbers("12, 18", values), npz::array("<f4", "4, 3, 6, 3", npz::bytesOf(single)),
        npz::array("<f8", "12, 18", npz::bytesOf(flat), true),
        npz::array("<f8", "4, 3, 6, 3", npz::bytesOf(deep), true)}) {
    const auto body = load(with("influence", content));
    ASSERT_TRUE(body) << body.error().what;
    expectWhole(*body);
  }
}

TEST_F(InfluenceFile, EveryFaultIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  std::vector<double> bad = counted(9 * kMarkers * kNodes);
  bad[3 * kNodes * 2 + 5] = nan;
  std::vector<double> areas = counted(kNodes), normals = inward(), outward = inward(), places = counted(3 * kMarkers);
  areas[4] = 0.0;
  normals[3 * 2] = 0.5;
  for (double& x : outward) x = -x;
  places[4] = -inf;
  const struct {
    std::string name, content, what;
  } cases[] = {
      {"format", npz::text("traction-influence/2"), "format is \"traction-influence/2\", and this program knows"},
      {"units", npz::text("mm"), "units is \"mm\" and not \"SI\""},
      {"youngs_modulus", npz::numbers("", {0.0}), "youngs_modulus is not above 0"},
      {"influence", npz::numbers("4, 3, 6, 3", bad), "influence[0, 2, 1, 2] is NaN"},
      {"influence", npz::numbers("12, 18", std::vector<double>(216)), "influence is all zero"},
      {"influence", npz::numbers("4294967296, 4294967296, 4294967296", counted(216)),
       "influence has a shape that its size contradicts"},
      {"influence", npz::array(">f8", "12, 18", npz::bytesOf(counted(216))), "influence is of type >f8"},
      {"influence", "nonsense", "influence is no NumPy array"},
      {"influence", std::string("\x93NUMPY\x01\x00\xff\xff{  ", 13), "influence is cut short in its header"},
      {"node_positions", npz::numbers("3, 6", counted(18)),
       "node_positions has the shape (3, 6) and not (any number, 3)"},
      {"node_normals", npz::numbers("6, 3", normals), "node_normals[2] has the length"},
      {"node_normals", npz::numbers("6, 3", outward), "node_normals point out of the body"},
      {"node_areas", npz::numbers("6,", areas), "node_areas[4] is not above 0"},
      {"marker_positions", npz::numbers("4, 3", places), "marker_positions[1, 1] is infinite"},
      {"marker_positions", npz::numbers("2, 3", counted(6)),
       "influence has the shape (4, 3, 6, 3) and not (2, 3, 6, 3)"},
  };
  for (const auto& [name, content, what] : cases) EXPECT_EQ(fault(with(name, content)).substr(0, what.size()), what);

  for (const Member& member : whole()) {
    std::vector<Member> members = whole();
    std::erase_if(members, [&](const Member& each) { return each.name == member.name; });
    EXPECT_EQ(fault(members), member.name + " is missing");
  }
}

TEST_F(InfluenceFile, WrongSignsAndUnitsAreNoticed) {
  const auto times = [](double factor) {
    std::vector<double> values = counted(9 * kMarkers * kNodes);
    for (double& value : values) value *= factor;
    return with("influence", npz::numbers("4, 3, 6, 3", values));
  };
  EXPECT_NE(fault(times(-1.0)).find("against the force"), std::string::npos) << fault(times(-1.0));
  for (const double factor : {1e3, 1e6, 1e-6}) {
    EXPECT_NE(fault(times(factor)).find("metres per newton"), std::string::npos) << fault(times(factor));
  }
  EXPECT_TRUE(load(times(0.1)));
}

const std::string kGel = "format = 1\n"
                         "[gel]\ninfluence_file = \"body.npz\"\n"
                         "[[layers]]\ncolour = \"blue\"\ncolumns = 2\nrows = 2\n"
                         "[nodes]\ncolumns = 3\nrows = 2\n";

TEST_F(InfluenceFile, GelFileNamesItBesideItself) {
  write(npz::archive(whole()));
  const auto sensor = sensor::loadGel(write(kGel, "gel.toml"));
  ASSERT_TRUE(sensor) << sensor.error().what;
  ASSERT_TRUE(sensor->body);
  expectWhole(*sensor->body);
  EXPECT_EQ(sensor->gel.youngsModulus, 2e3);
  EXPECT_TRUE(sensor::markerPositions(*sensor).isApprox(sensor->body->markers));
  EXPECT_TRUE(sensor::nodePositions(*sensor).isApprox(sensor->body->nodes));
  EXPECT_NEAR(sensor->layers[0].depth, 7.5e-3, 1e-12);
  EXPECT_NEAR(sensor->nodes.pitch, std::sqrt(3.5e-6), 1e-12);

  const std::string text = sensor::gelText(*sensor);
  const auto again = sensor::loadGel(write(text, "again.toml"));
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(sensor::gelText(*again), text);
}

TEST_F(InfluenceFile, GelFileThatContradictsItIsRefused) {
  write(npz::archive(whole()));
  const auto fault = [this](const std::string& from, const std::string& to) {
    std::string text = kGel;
    text.replace(text.find(from), from.size(), to);
    const auto sensor = sensor::loadGel(write(text, "gel.toml"));
    return sensor ? "" : sensor.error().what;
  };
  EXPECT_EQ(fault("columns = 3", "columns = 4"), "node_positions holds 6 nodes, and the gel file's [nodes] has 4 x 2");
  EXPECT_EQ(fault("columns = 2", "columns = 5"),
            "marker_positions holds 4 markers, and the gel file's [[layers]] have 10");
  EXPECT_EQ(fault("rows = 2\n[nodes]", "rows = 2\npitch_mm = 3\n[nodes]"),
            "layers[0].pitch_mm does not go with gel.influence_file, which says it");
  EXPECT_EQ(fault("[[layers]]", "poisson_ratio = 0.4\n[[layers]]"),
            "gel.poisson_ratio does not go with gel.influence_file, which says it");
  EXPECT_EQ(fault("[nodes]", "[uncertainty]\nthickness_mm = 0.1\n[nodes]"),
            "uncertainty.thickness_mm does not go with gel.influence_file, which says it");
  EXPECT_EQ(fault("[[layers]]", "thickness_mm = 10\n[[layers]]").substr(0, 45),
            "marker_positions[3] has z = 0.012000 m, and t");
  EXPECT_NE(fault("body.npz", "nowhere.npz"), "");
}

}  // namespace

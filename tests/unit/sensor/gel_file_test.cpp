#include "sensor/gel_file.h"
#include "tests/support/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace {

using sensor::parseGel;
using sensor::Sensor;
using tractiond::FileError;

std::string content(const std::string& path) {
  std::ifstream file(tractiond::test::source(path));
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The paper's file with one text replaced by another.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = content("config/gels/paper.toml");
  const std::size_t place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

FileError fault(const std::string& text) {
  const auto parsed = parseGel(text, "gel.toml");
  EXPECT_FALSE(parsed.has_value());
  return parsed ? FileError{} : parsed.error();
}

int lineOf(const std::string& text, const std::string& part) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(text.find(part)), '\n'));
}

TEST(GelFile, PaperTomlHoldsTheDefaults) {
  const auto loaded = sensor::loadGel(tractiond::test::source("config/gels/paper.toml"));
  ASSERT_TRUE(loaded.has_value()) << loaded.error().what;
  EXPECT_EQ(sensor::gelText(*loaded), sensor::gelText({}));
}

/// Files keep their text, and with it their hash.
TEST(GelFile, EveryKeyIsWrittenAndRead) {
  Sensor sensor;
  sensor.gel = {0.2e6 / 3.0, 0.4321, {61.7e-3, 59.3e-3, 15.1e-3}};
  sensor.layers.resize(1);
  sensor.layers[0] = {sensor::Colour::kGreen, 11, 7, 2.34567e-3, 5.1e-3, {-0.3e-3, 0.7e-3}, 0.45e-3, true};
  sensor.nodes = {9, 8, 3.3e-3, {0.1e-3, -0.2e-3}};
  sensor.camera = {800,  600,  1234.5, 1.035, {401.25, 298.5}, -0.11, 0.013, {1e-3, 2e-3, 99e-3}, {0.01, -0.02, 0.03},
                   1.41, 1.49, 8e-3,   {}};
  sensor.uncertainty = {.youngsModulus = 0.011,
                        .poissonRatio = 0.0037,
                        .thickness = 0.31e-3,
                        .layerDepth = 0.17e-3,
                        .markerDepth = 0.07e-3,
                        .markerPlace = 0.23e-3,
                        .model = 0.007,
                        .focal = 0.0013,
                        .position = {0.1e-3, 0.2e-3, 0.4e-3},
                        .rotation = {0.001, 0.003, 0.005},
                        .focalDistance = 0.99 / 1.1,
                        .principal_px = 0.21,
                        .k1 = 0.0017,
                        .k2 = 0.019};
  sensor.pictureMotion = {0.031, 2.5e-5, 3.5e-5};
  sensor.creep = {{.share = 0.021, .time_s = 0.7, .deviation = 0.0013, .correlation = {}},
                  {.share = 0.034, .time_s = 22.5, .deviation = 0.0024, .correlation = {-0.31}}};
  sensor.calibration = {.camera = "A \"camera\"-12",
                        .date = "2026-11-20T08:15:30Z",
                        .geometry = "2026-11-20T08:00:00Z",
                        .residual_px = 0.01 / 3,
                        .noise = "",
                        .noise_px = 0.5,
                        .stiffness = "2026-11-20T08:10:00Z",
                        .weights = {0.980665, 1.0 / 3},
                        .readings = {0.99, 1.0 / 7},
                        .linearity = 0.02,
                        .hash = "0123456789abcdef0123456789abcdef"};
  const std::string text = content("tests/unit/sensor/every_key.toml");
  EXPECT_EQ(sensor::gelText(sensor), text);
  const auto read = parseGel(text, "gel.toml");
  ASSERT_TRUE(read) << read.error().where << read.error().what;
  EXPECT_EQ(sensor::gelText(*read), text);
  // What a file has not had before a key existed is not written.
  EXPECT_EQ(sensor::gelText({}).find("aspect"), std::string::npos);
}

TEST(GelFile, SurfacesAreWrittenAndRead) {
  Sensor curved;
  curved.camera.surfaces = {{{1.1e-3, -0.7e-3, 150e-3}, {130e-3, 120e-3, 110e-3}, 1.49},
                            {{0, 0, 50.1e-3}, {0, 0, 0}, 1.0}};
  const std::string text = sensor::gelText(curved);
  EXPECT_NE(text.find("\n[[camera.surfaces]]\ncentre_mm = [1.1, -0.7, 150]\nradii_mm = [130, 120, 110]\nindex = 1.49\n"
                      "\n[[camera.surfaces]]\ncentre_mm = [0, 0, 50.1]\nindex = 1\n"),
            std::string::npos);
  EXPECT_EQ(sensor::gelText(parseGel(text, "written").value()), text);
}

TEST(GelFile, FisheyeIsWrittenAndRead) {
  Sensor wide;
  wide.camera.fisheye = true;
  wide.camera.k3 = 0.01;
  wide.camera.k4 = -0.002;
  const std::string text = sensor::gelText(wide);
  EXPECT_NE(text.find("\nlens = \"fisheye\"\nk3 = 0.01\nk4 = -0.002\n"), std::string::npos);
  EXPECT_EQ(sensor::gelText(parseGel(text, "written").value()), text);
  EXPECT_EQ(sensor::gelText({}).find("lens"), std::string::npos);
}

TEST(GelFile, UnknownKeyIsNamedWithLineAndNearestKey) {
  const std::string text = changed("poisson_ratio", "poison_ratio");
  const FileError error = fault(text);
  EXPECT_EQ(error.where, "gel.toml:" + std::to_string(lineOf(text, "poison_ratio")));
  EXPECT_EQ(error.what, "unknown key 'gel.poison_ratio'; the nearest known key is 'gel.poisson_ratio'");
}

TEST(GelFile, ImpossibleSensorsAreRejectedWhereTheyAreWritten) {
  const std::string kTerm = "[[creep]]\nshare = 0.1\ntime_s = 1\ndeviation = 0.01\n";
  const struct {
    std::string from, to, what;
  } cases[] = {
      {"poisson_ratio = 0.49", "poisson_ratio = 0.5", "gel.poisson_ratio must be below 0.5"},
      {"thickness_mm = 40", "thickness_mm = 0", "gel.thickness_mm = 0 must be between"},
      {"thickness_mm = 40", "thickness_mm = 7", "layers[1].depth_mm places markers outside"},
      {"width_mm = 100", "width_mm = 71", "layers[1].pitch_mm and the counts place markers outside"},
      {"diameter_mm = 0.6", "diameter_mm = 3", "layers[0].diameter_mm is not below the pitch"},
      {"position_mm = [0, 0, 157]", "position_mm = [0, 0, 40]", "camera.position_mm is not behind"},
      {"aspect = 1 ", "aspect = 3.5 ", "camera.aspect = 3.5 must be between 0.5 and 2"},
      {"k2 = 0\n", "k2 = 0\nk3 = 0.1\n", "camera.k3 needs lens = \"fisheye\""},
      {"k2 = 0\n", "k2 = 0\nlens = \"wide\"\n", "camera.lens must be one of \"pinhole\", \"fisheye\""},
      {"k2 = 0\n", "k2 = -5\nlens = \"fisheye\"\n", "camera.k1 to k4 fold the picture"},
      {"youngs_modulus_pa = 180000", "youngs_modulus_pa = \"soft\"", "gel.youngs_modulus_pa must be a number"},
      {"youngs_modulus_pa = 180000", "youngs_modulus_pa = 9007199254740993",
       "gel.youngs_modulus_pa = 9.007199255e+15 "},  // an integer that no double is
      {"columns = 24", "columns = 24.5", "layers[0].columns must be a whole number"},
      {"colour = \"blue\"", "colour = \"pink\"",
       "layers[0].colour must be one of \"blue\", \"red\", \"green\", \"grey\""},
      {"format = 1 ", "format = 2 ", "format = 2 is newer than this program"},
      {"[uncertainty]", "[calibration]\ncamera = \"a\"\ndate = \"b\"\n[uncertainty]", "calibration.hash is missing"},
      {"format = 1 ", "# ", "format is missing"},
      {"[uncertainty]", "[[creep]]\nshare = 0.1\ntime_s = 1\n[uncertainty]", "creep[0].deviation is missing"},
      {"[uncertainty]", kTerm + kTerm + "[uncertainty]", "creep[1].time_s must be above that of the term before"},
      {"[uncertainty]", kTerm + "correlation = [0.5]\n[uncertainty]",
       "creep[0].correlation must have a number for each"},
      {"[uncertainty]",
       kTerm + "[[creep]]\nshare = 0.1\ntime_s = 2\ndeviation = 0.01\ncorrelation = [1]\n" +
           "[[creep]]\nshare = 0.1\ntime_s = 3\ndeviation = 0.01\ncorrelation = [1, -1]\n[uncertainty]",
       "creep[2].correlation contradicts those of the terms before"},
  };
  for (const auto& [from, to, what] : cases) {
    const FileError error = fault(changed(from, to));
    EXPECT_EQ(error.what.substr(0, what.size()), what);
    EXPECT_EQ(error.where.substr(0, 9), "gel.toml:");
  }
}

TEST(GelFile, ImpossibleWindowsAreRejected) {
  const auto surface = [](const std::string& z, const std::string& rest) {
    return "\n[[camera.surfaces]]\ncentre_mm = [0, 0, " + z + "]\n" + rest + "\n";
  };
  const struct {
    std::string camera, what;
  } cases[] = {
      {surface("50", ""), "camera.surfaces[0].index is missing"},
      {surface("50", "index = 1.49"), "camera.surfaces[0].index of the last surface must be 1"},
      {surface("50", "index = 1\nradii_mm = [9, 9, 0]"), "camera.surfaces[0].radii_mm = 0 must be between"},
      {surface("50", "index = 1.5") + surface("45", "index = 1"), "camera.surfaces[1].centre_mm places it before"},
      {"window_index = 1.49\n" + surface("50", "index = 1"), "camera.window_index does not go with camera.surfaces"},
      {surface("200", "index = 1"), "camera.position_mm is not behind"},
      {surface("40", "radii_mm = [20, 20, 20]\nindex = 1"),
       "camera.surfaces: no light from marker 0 at (-34.5, -34.5, 6) mm"},
      {surface("160", "radii_mm = [155, 155, 155]\nindex = 1"), "camera.surfaces: no light from marker 154 at ("},
  };
  for (const auto& [camera, what] : cases) {
    const FileError error = fault("format = 1\n[camera]\ngel_index = 1.41\n" + camera);
    EXPECT_EQ(error.what.substr(0, what.size()), what);
  }
}

TEST(GelFile, NodesThatAreNotStatedFollowTheMarkers) {
  const auto nodes = [](const std::string& layer) {
    return parseGel("format = 1\n[[layers]]\ncolour = \"blue\"\ncolumns = 5\nrows = 4\ncentre_mm = [1, 2]\n" + layer,
                    "gel.toml")
        .value()
        .nodes;
  };
  const sensor::NodeGrid near = nodes("pitch_mm = 12\ndepth_mm = 6\n"), far = nodes("pitch_mm = 15\ndepth_mm = 6\n");
  EXPECT_EQ(std::tuple(near.columns, near.rows, near.pitch), std::tuple(5, 4, 12e-3));
  EXPECT_EQ(near.centre, Eigen::Vector2d(1e-3, 2e-3));
  EXPECT_EQ(std::tuple(far.columns, far.rows, far.pitch), std::tuple(9, 7, 7.5e-3));
  EXPECT_EQ(nodes("pitch_mm = 12\ndepth_mm = 6\n[nodes]\ncolumns = 3\n").columns, 3);
}

TEST(GelFile, DefaultsThatDoNotFitAreSaid) {
  const FileError error = fault("format = 1\n[gel]\nthickness_mm = 5\n");
  EXPECT_EQ(error.what, "layers is missing, and the paper's depth_mm places markers outside the gel");
}

TEST(GelFile, SyntaxErrorsAndMissingFilesAreErrors) {
  EXPECT_EQ(fault("format = 1\n[gel\n").where, "gel.toml:2");
  for (const char* path : {"/nonexistent/gel.toml", "/"}) {
    const auto missing = sensor::loadGel(path);
    ASSERT_FALSE(missing.has_value());
    EXPECT_TRUE(missing.error().unreadable);
    EXPECT_EQ(missing.error().where, path);
  }
}

}  // namespace

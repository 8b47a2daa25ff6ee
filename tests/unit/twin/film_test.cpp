#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"
#include "twin/film.h"
#include "twin/truth_writer.h"

#include <gtest/gtest.h>
#include <sysexits.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace {

using namespace twin;

Scenario shipped(const std::string& name) {
  // The fingertip's own gel takes traction-gel minutes.
  const std::string gel = name.starts_with("fingertip") ? tractiond::test::source("config/gels/paper.toml") : "";
  const auto scenario = loadScenario(tractiond::test::source("twin/scenarios/" + name + ".toml"), gel);
  EXPECT_TRUE(scenario.has_value()) << scenario.error().where << ": " << scenario.error().what;
  return scenario.value_or(Scenario{});
}

Picture picture(double time_s, std::uint64_t number = 0) {
  Picture made;
  made.time_s = time_s;
  made.number = number;
  return made;
}

std::vector<std::string> shippedNames() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(tractiond::test::source("twin/scenarios")))
    names.push_back(entry.path().stem());
  return names;
}

TEST(Scenarios, AllAreReadableAndStartWithFourSecondsOfRest) {
  const std::vector<std::string> names = shippedNames();
  EXPECT_GE(names.size(), 8U);
  for (const std::string& name : names) {
    const Scenario scenario = shipped(name);
    for (const Contact& contact : scenario.contacts) {
      EXPECT_FALSE(contact.at(0.0).isLoaded()) << name;
      EXPECT_FALSE(contact.at(4.0).isLoaded()) << name;
      const bool isForGood = scenario.period_s > 1000;
      EXPECT_EQ(contact.at(scenario.period_s - 1e-3).isLoaded(), isForGood) << name;
    }
  }
}

TEST(Film, PressIsFourHundredGramForceAndPushesMarkersApart) {
  Scenario scenario = shipped("press");
  scenario.sensor.layers.resize(1);
  GelFilm film(scenario, 0, {});
  Truth truth;
  Picture frame = picture(10.0);
  film.draw(frame, truth);
  EXPECT_NEAR(truth.resultant.force.z(), 0.4 * 9.80665, 1e-9);
  ASSERT_EQ(truth.contacts.size(), 1U);
  // Blue marker of column 16, row 11 is right of the contact and near it: it goes right, by a pixel or two.
  EXPECT_GT(truth.displacement_px(0, 11 * 24 + 13), 0.5);
  EXPECT_LT(truth.displacement_px(0, 11 * 24 + 10), -0.5);
  // Above the contact (a higher row) is up, which is a smaller v.
  EXPECT_LT(truth.displacement_px(1, 13 * 24 + 12), -0.5);
  film.draw(frame = picture(2.0), truth);
  EXPECT_EQ(truth.displacement_px.norm(), 0.0);
  film.draw(frame = picture(42.0), truth);  // the second round
  EXPECT_EQ(truth.displacement_px.norm(), 0.0);
}

TEST(HandFilm, FingersSeeTheObjectHangFromThem) {
  Scenario scenario = shipped("egg");
  for (sensor::MarkerLayer& layer : scenario.sensor.layers) layer.columns = layer.rows = 8;  // those in the middle
  HandFilm film(scenario, 0, {});
  film.hand().command(42.6e-3, 0.0);
  film.hand().advance(1.0);
  film.hand().command(42.6e-3, 10e-3);
  film.hand().advance(1.0);
  for (const int finger : {0, 1}) {
    Picture frame = picture(2.0);
    Truth truth;
    film.draw(finger, frame, truth);
    EXPECT_EQ(truth.finger, finger);
    ASSERT_EQ(truth.contacts.size(), 1U);
    const ContactState& state = truth.contacts[0].state;
    EXPECT_NEAR(state.force.y(), -0.06 * 9.80665 / 2, 0.01);
    EXPECT_NEAR(state.force.z() / film.hand().state().normal, 1.0, 0.01);
    EXPECT_TRUE(truth.resultant.force.isApprox(state.force, 1e-9));
    EXPECT_GT(truth.displacement_px.row(1).maxCoeff(), 0.3);  // the gel follows the object down: to a larger v
  }
}

TEST(Film, MissingMarkersAreNotDrawnButTold) {
  Scenario scenario = shipped("missing_markers");
  scenario.optics.readNoise = 0.0;
  scenario.contacts.clear();
  GelFilm film(scenario, 0, {});
  Truth truth;
  Picture frame = picture(1.0);
  film.draw(frame, truth);
  EXPECT_EQ(truth.missing.size(), 58U);
  const sensor::Projection project(scenario.sensor.camera, scenario.sensor.gel.size.z());
  const sensor::Points rest = sensor::markerPositions(scenario.sensor.layers);
  for (int marker = 0; marker < rest.cols(); ++marker) {
    const bool isMissing = std::find(truth.missing.begin(), truth.missing.end(), marker) != truth.missing.end();
    const Eigen::Vector2d pixel = project(rest.col(marker)).array().round();
    const auto sample = static_cast<std::size_t>((pixel.y() * 640 + pixel.x()) * 3 + (marker < 576 ? 2 : 0));
    EXPECT_EQ(frame.pixels[sample] < 60, isMissing) << marker;
  }
}

TEST(Film, SameSeedSameFrameSameNoise) {
  const Scenario scenario = shipped("idle");
  GelFilm film(scenario, 7, {}), other(scenario, 8, {});
  Truth truth;
  Picture a = picture(0.0, 3), b = picture(0.0, 3), c = picture(0.0, 4), d = picture(0.0, 3);
  film.draw(a, truth);
  film.draw(b, truth);
  film.draw(c, truth);
  other.draw(d, truth);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_NE(a.pixels, c.pixels);
  EXPECT_NE(a.pixels, d.pixels);
}

TEST(Film, TheLedDriftsAsDescribed) {
  Scenario scenario = shipped("idle");
  scenario.optics.readNoise = 0.0;
  scenario.optics.drift = 0.2;
  scenario.optics.driftPeriod = 12.0;
  GelFilm film(scenario, 0, {});
  Truth truth;
  Picture start = picture(0.0), bright = picture(3.0), dim = picture(9.0);
  film.draw(start, truth);
  film.draw(bright, truth);
  film.draw(dim, truth);
  for (std::size_t i = 0; i < start.pixels.size(); i += 101) {
    EXPECT_NEAR(bright.pixels[i], 1.2 * start.pixels[i], 1.2);
    EXPECT_NEAR(dim.pixels[i], 0.8 * start.pixels[i], 1.2);
  }
}

TEST(Film, TheGelGrowsAndThePictureMovesWithTheTemperature) {
  Scenario scenario = shipped("idle");
  scenario.warmth = {.times = {0.0, 10.0},
                     .rise = {0.0, 2.0},
                     .expansion = 3e-4,
                     .shift_px = {0.1, -0.2},
                     .scale = 1e-5,
                     .roll = 2e-5};
  scenario.period_s = 20.0;
  GelFilm film(scenario, 0, {});
  Truth truth;
  Picture frame = picture(5.0);
  film.draw(frame, truth);
  EXPECT_DOUBLE_EQ(truth.rise_K, 1.0);
  // The last blue marker is at 34.5 mm in x and y: 220.8 px from the middle, right and up.
  const Eigen::Vector2d corner = truth.displacement_px.col(575);
  const double towards = 34e-3 * 3e-4 / 151e-3;  // the gel's surface grows towards the camera's other side
  EXPECT_NEAR(corner.x(), 220.8 * (3e-4 - towards + 1e-5) + 0.1 + 220.8 * 2e-5, 2e-3);
  EXPECT_NEAR(corner.y(), -220.8 * (3e-4 - towards + 1e-5) - 0.2 + 220.8 * 2e-5, 2e-3);
  frame = picture(15.0);
  film.draw(frame, truth);
  EXPECT_DOUBLE_EQ(truth.rise_K, 2.0);
  EXPECT_NEAR(truth.displacement_px(0, 575), 2.0 * corner.x(), 2e-3);
}

TEST(Film, ALoadedGelCreeps) {
  Scenario scenario = shipped("press");
  scenario.sensor.layers.resize(1);
  GelFilm elastic(scenario, 0, {});
  scenario.creep = {{.share = 0.1, .time_s = 2.0}};
  GelFilm film(scenario, 0, {});
  Truth truth, atOnce;
  Picture frame = picture(0.0);
  for (double time = 0.0; time < 15.0; time += 0.05) {
    frame.time_s = time;
    film.draw(frame, truth);
  }
  frame.time_s = 15.0;
  elastic.draw(frame, atOnce);
  EXPECT_NEAR(truth.displacement_px.norm() / atOnce.displacement_px.norm(), 1.1, 2e-3);
  EXPECT_EQ(truth.resultant.force, atOnce.resultant.force);
}

TEST(Film, RawPicturesComeInALoop) {
  const tractiond::test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "two.raw";
  std::ofstream(file, std::ios::binary) << "aaaabbbb";
  const auto film = RawFilm::open(file, Format::kRgb8, 4);
  ASSERT_TRUE(film.has_value());
  Truth truth;
  for (const std::uint64_t number : {0U, 1U, 2U, 3U}) {
    Picture frame = picture(0.0, number);
    (*film)->draw(frame, truth);
    EXPECT_EQ(frame.pixels, std::vector<std::uint8_t>(4, number % 2 == 0 ? 'a' : 'b'));
    EXPECT_EQ(truth.image, number % 2);
  }
  EXPECT_EQ(toJson(truth, {9, 8, 7}, true),
            R"({"camera_frame_id":9,"device_ns":8,"monotonic_ns":7,"scenario_s":0,"image":1})");
  // A client may choose another format, of which the camera's buffer has the size.
  Picture other = picture(0.0, 0);
  other.format = Format::kMono8;
  other.pixels.resize(2);
  (*film)->draw(other, truth);
  EXPECT_EQ(other.pixels, std::vector<std::uint8_t>(2, 0));
  EXPECT_EQ(RawFilm::open(file, Format::kRgb8, 3).error().exitCode, EX_DATAERR);
  EXPECT_EQ(RawFilm::open(folder.path() / "none.raw", Format::kRgb8, 3).error().exitCode, EX_NOINPUT);
}

TEST(Truth, RecordIsJsonWithAllThatIsKnown) {
  Truth truth;
  truth.time_s = 1.5;
  truth.contacts.push_back({Contact::Shape::kDisc, 4e-3, {{1e-3, -2e-3}, {0.5, 0, 2}, 3e-3}, {}, {}});
  truth.resultant.add(truth.contacts[0].state);
  truth.missing = {3, 7};
  truth.displacement_px.resize(2, 2);
  truth.displacement_px << 1, 3, 2, -4;
  EXPECT_EQ(toJson(truth, {65535, 2, 3}, true),
            R"({"camera_frame_id":65535,"device_ns":2,"monotonic_ns":3,"scenario_s":1.5,"force_N":[0.5,0,2],)"
            R"("moment_Nm":[-0.004,-0.002,0.004],"contacts":[{"shape":"disc","position_m":[0.001,-0.002],)"
            R"("radius_m":0.004,"force_N":[0.5,0,2],"torque_Nm":0.003}],"missing":[3,7],)"
            R"("displacement_px":[1.0000,2.0000,3.0000,-4.0000]})");
}

}  // namespace

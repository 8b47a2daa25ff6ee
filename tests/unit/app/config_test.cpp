#include "daemon/app/config.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>

namespace tractiond {
namespace {

tl::expected<Config, Error> parsed(const std::string& text) {
  std::istringstream stream(text);
  return parseConfig(stream, "test.toml");
}

/// The line of the error, "" where there is none.
std::string errorOf(const std::string& text) {
  const auto config = parsed(text);
  if (config) return "";
  EXPECT_EQ(config.error().exitCode, EX_CONFIG);
  return config.error().message();
}

TEST(Config, OfAnyWindowsEditorIsReadOrRefusedByItsEncoding) {
  const std::string text = "[sensor]\nname = \"left\"\n";
  EXPECT_EQ(parsed("\xEF\xBB\xBF" + text)->sensor.name, "left");
  std::string little, big;
  for (const char c : text) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  for (const std::string& wide : {"\xFF\xFE" + little, "\xFE\xFF" + big, little}) {
    EXPECT_NE(errorOf(wide).find("as in UTF-16 (\"Unicode\" in old Notepads): save it as UTF-8"), std::string::npos)
        << errorOf(wide);
  }
  std::cout << "  a configuration in UTF-16: " << errorOf(little) << "; right: refused by its encoding\n";
}

TEST(Config, FalseAlarmsAreThoseAtTheCamerasRate) {
  EXPECT_EQ(parsed("")->solve.frameRate_Hz, 60.0);
  EXPECT_EQ(parsed("[camera]\nframe_rate_hz = 120\n")->solve.frameRate_Hz, 120.0);
}

TEST(Config, ShippedFileIsTheDefaultsWithEveryKey) {
  std::ifstream stream(test::source("config/tractiond.toml"));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(text, configText(Config{})) << "run: tractiond --print-config > config/tractiond.toml";
}

TEST(Config, PrintedTextReadsBackToTheSame) {
  auto config = parsed(R"(
[sensor]
name = "left-1"
gel_file = 'a "quoted" \ path'
[camera]
wait = false
gain = 1.5
exposure_us = 333.25
offset_x_px = 0
trigger = "Line1"
chunks = ["ExposureTime", "Gain"]
features = [{ Zulu = 1, Alpha = 2.0 }, { "With space" = "text" }, { Zulu = 2 }, { Mike = true }]
[solve]
model = "half-space"
noise_px = 0.0123
[publish]
stream = ["tcp://*:1234", "ipc:///run/x"]
insecure = true
)");
  ASSERT_TRUE(config) << config.error().message();
  const std::string text = configText(*config);
  const auto again = parsed(text);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(configText(*again), text);
  EXPECT_EQ(again->sensor.gelFile, "a \"quoted\" \\ path");
  EXPECT_EQ(again->camera.offsetX, 0);
  EXPECT_EQ(again->camera.offsetY, -1);
  EXPECT_EQ(again->solve.noise_px, 0.0123);
}

TEST(Config, BindsToThisHostAloneUnlessToldOtherwise) {
  for (const char* key : {"stream", "latest", "control"}) {
    for (const char* own : {"tcp://127.0.0.1:1", "tcp://127.3.2.1:*", "tcp://localhost:1", "tcp://lo:1",
                            "tcp://[::1]:1", "ipc:///run/x", "ipc://@x"}) {
      EXPECT_TRUE(parsed(fmt::format("[publish]\n{} = [\"{}\"]\n", key, own))) << own;
    }
    for (const char* open : {"tcp://*:1", "tcp://0.0.0.0:1", "tcp://[::]:1", "tcp://eth0:1", "tcp://10.0.0.7:1",
                             "tcp://localhost.example:1", "tcp://lo0:1", "tcp://1270:1"}) {
      const std::string text = fmt::format("[publish]\n{} = [\"tcp://127.0.0.1:1\", \"{}\"]\n", key, open);
      const auto refused = parsed(text);
      ASSERT_FALSE(refused) << open;
      EXPECT_NE(refused.error().message().find("publish.insecure = true"), std::string::npos);
      EXPECT_TRUE(parsed(text + "insecure = true\n")) << open;
    }
  }
}

TEST(Config, NamesProcessorsThatAreNoList) {
  for (const char* list : {"2-", "3-2", "a", "0,,1", "1024", "0 1", "-1"}) {
    const std::string error = errorOf(fmt::format("[realtime]\ncpus = \"{}\"\n", list));
    EXPECT_EQ(error, fmt::format("test.toml:2: realtime.cpus = \"{}\" is no list of processors like 0-2,5, each below "
                                 "1024",
                                 list));
  }
}

TEST(Config, KeepsTheFeaturesInTheOrderOfTheFile) {
  const auto config = parsed("[camera]\nfeatures = [{ Zulu = 1 }, { Alpha = 2.0, Mike = \"m\" }, { Bravo = true },\n"
                             "  { Zulu = 3 }, { Mike = \"n\" }]\n");
  ASSERT_TRUE(config) << config.error().message();
  using Feature = std::pair<std::string, decltype(capture::Feature::value)>;
  std::vector<Feature> features;
  for (const auto& [name, value] : config->camera.features) features.emplace_back(name, value);
  EXPECT_EQ(features, (std::vector<Feature>{{"Zulu", std::int64_t{1}},
                                            {"Alpha", 2.0},
                                            {"Mike", "m"},
                                            {"Bravo", true},
                                            {"Zulu", std::int64_t{3}},
                                            {"Mike", "n"}}));
}

TEST(Config, EveryNumberIsRefusedOutsideItsRange) {
  Config config;
  int numbers = 0;
  for (const Key& key : keysOf(config)) {
    if (key.range.least == key.range.most) continue;
    ++numbers;
    const bool whole = std::holds_alternative<int*>(key.value);
    for (const double beyond : {key.range.least - 1, key.range.most + 1}) {
      const std::string value = whole ? std::to_string(static_cast<std::int64_t>(beyond)) : std::to_string(beyond);
      const std::string section(key.section), name(key.name);
      const std::string error = errorOf("[" + section + "]\n\n" + name + " = " + value + "\n");
      EXPECT_EQ(error.rfind("test.toml:3: " + section + "." + name + " = ", 0), 0U) << error;
      EXPECT_NE(error.find("must be between"), std::string::npos) << error;
    }
  }
  EXPECT_GT(numbers, 10);
}

TEST(Config, EveryKeyIsRefusedWithAWrongType) {
  Config config;
  for (const Key& key : keysOf(config)) {
    const std::string error =
        errorOf("[" + std::string(key.section) + "]\n" + std::string(key.name) + " = 1979-05-27\n");
    EXPECT_EQ(error.rfind("test.toml:2: " + std::string(key.section) + "." + std::string(key.name) + " must be ", 0),
              0U)
        << error;
  }
}

TEST(Config, NamesTheNearestKeyOfAnUnknownOne) {
  EXPECT_EQ(errorOf("[camera]\nid = \"x\"\npaket_size_bytes = 9000\n"),
            "test.toml:3: unknown key 'camera.paket_size_bytes'; the nearest known key is 'camera.packet_size_bytes'");
  EXPECT_EQ(errorOf("[camra]\nid = \"x\"\n"), "test.toml:1: unknown key 'camra'; the nearest known key is 'camera'");
  EXPECT_EQ(errorOf("wait = true\n").rfind("test.toml:1: unknown key 'wait'", 0), 0U);
}

TEST(Config, OfARecordingMayHaveKeysOfOtherVersions) {
  const auto config = parseRecordedConfig("[solve]\nsolver = \"contact-step\"\nnoise_px = 0.02\n[past]\n", "test.mcap");
  ASSERT_TRUE(config) << config.error().message();
  EXPECT_EQ(config->solve.noise_px, 0.02);
  EXPECT_FALSE(parseRecordedConfig("[solve]\nnoise_px = -1\n", "test.mcap"));
}

TEST(Config, RefusesWhatIsNotToml) {
  EXPECT_EQ(errorOf("[camera]\nid = \n").rfind("test.toml:2: ", 0), 0U);
  EXPECT_EQ(errorOf("[camera]\nwait = true\nwait = false\n").rfind("test.toml:3: ", 0), 0U);
  EXPECT_NE(errorOf(std::string("\xff\xfe\0\1", 4)), "");
}

TEST(Config, RefusesAWordThatIsNoneOfThoseKnown) {
  EXPECT_EQ(errorOf("[solve]\nmodel = \"sphere\"\n"),
            "test.toml:2: solve.model = \"sphere\" must be one of \"block\", \"half-space\"");
  EXPECT_EQ(errorOf("[camera]\npixel_format = \"Mono9\"\n")
                .rfind("test.toml:2: camera.pixel_format \"Mono9\" is not supported; supported formats: Mono, ", 0),
            0U);
  EXPECT_NE(errorOf("[log]\nlevel = \"loud\"\n"), "");
}

TEST(Config, RefusesNamesAndEndpointsThatCannotBe) {
  EXPECT_NE(errorOf("[sensor]\nname = \"with space\"\n"), "");
  EXPECT_NE(errorOf("[sensor]\nname = \"a/b\"\n"), "");
  EXPECT_EQ(errorOf("[publish]\n\nstream = [\"udp://x\"]\n"),
            "test.toml:3: publish.stream holds \"udp://x\", which is neither tcp://ADDRESS:PORT nor ipc://PATH");
  EXPECT_NE(errorOf("[publish]\nstream = [1]\n"), "");
}

TEST(Config, RefusesNumbersThatAreNone) {
  EXPECT_NE(errorOf("[solve]\nnoise_px = nan\n"), "");
  EXPECT_NE(errorOf("[camera]\nbuffers = 10.5\n"), "");
  EXPECT_NE(errorOf("[camera]\nfeatures = [{ Gain = [1] }]\n"), "");
  EXPECT_NE(errorOf("[camera]\nfeatures = 3\n"), "");
  EXPECT_NE(errorOf("[camera.features]\nGain = 1\n"), "") << "a table cannot hold a name twice";
}

TEST(Config, SaysWhatChangedBetweenTwoAndWhatOfItAReloadTakes) {
  EXPECT_TRUE(changesBetween({}, *parsed("[camera]\nexposure_us = 0\n")).empty());
  const auto changes = changesBetween(*parsed("[camera]\ngain = 1.5\n"),
                                      *parsed("[camera]\nwidth_px = 640\nexposure_us = 250.5\n[publish]\nstream = "
                                              "[\"ipc:///x\"]\n[log]\nlevel = \"debug\"\n"));
  std::string text;
  for (const Change& change : changes)
    text += fmt::format("{} {} {} {}\n", change.key, change.before, change.after, change.live);
  EXPECT_EQ(text, "camera.width_px 0 640 false\ncamera.exposure_us 0 250.5 true\ncamera.gain 1.5  true\n"
                  "publish.stream [] [\"ipc:///x\"] false\nlog.level \"info\" \"debug\" true\n");
}

TEST(Config, FindsTheGelFileBesideItself) {
  const test::TemporaryFolder folder;
  const auto gelFileOf = [&](const std::string& written) {
    const auto path = folder.path() / "tractiond.toml";
    std::ofstream(path) << "[sensor]\ngel_file = \"" << written << "\"\n";
    return loadConfig(path).value().sensor.gelFile;
  };
  EXPECT_EQ(gelFileOf("gels/soft.toml"), folder.path() / "gels/soft.toml");
  EXPECT_EQ(gelFileOf("/gels/soft.toml"), "/gels/soft.toml");
  EXPECT_EQ(gelFileOf("none"), kNoGelFile);
  EXPECT_EQ(gelFileOf("./none"), folder.path() / "./none");
}

TEST(Config, ThatCannotBeReadIsNoInput) {
  for (const char* path : {"/nowhere/tractiond.toml", "/tmp"}) {
    const auto config = loadConfig(path);
    ASSERT_FALSE(config);
    EXPECT_EQ(config.error().exitCode, EX_NOINPUT);
    EXPECT_NE(config.error().message().find(path), std::string::npos);
  }
}

}  // namespace
}  // namespace tractiond

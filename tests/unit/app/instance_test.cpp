#include "daemon/app/instance.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace tractiond::instance_test {
namespace {

namespace fs = std::filesystem;

struct Folder : test::TemporaryFolder {
  fs::path operator/(const char* name) const { return path() / name; }
};

TEST(Instance, TakesTheDirectoriesThatSystemdMade) {
  setenv("STATE_DIRECTORY", "/var/lib/tractiond/left", 1);
  setenv("RUNTIME_DIRECTORY", "/run/tractiond/left", 1);
  const auto places = located({.instance = "left"});
  unsetenv("STATE_DIRECTORY");
  unsetenv("RUNTIME_DIRECTORY");
  ASSERT_TRUE(places);
  EXPECT_EQ(places->state, "/var/lib/tractiond/left");
  EXPECT_EQ(places->runtime, "/run/tractiond/left");
}

TEST(Instance, WithoutBothEndsInItsName) {
  const auto places = located({.instance = "left"});
  ASSERT_TRUE(places);
  EXPECT_EQ(places->state.filename(), "left");
  EXPECT_EQ(places->runtime.filename(), "left");
}

TEST(Instance, RefusesAnImpossibleName) {
  EXPECT_EQ(located({.instance = "a/b"}).error().exitCode, EX_USAGE);
}

TEST(Instance, HasEndpointsOfItsOwnAndTheDefaultOneTcpAsWell) {
  const Config left = completed({}, {.instance = "left", .runtime = "/r"});
  EXPECT_EQ(left.publish.stream, std::vector<std::string>{"ipc:///r/stream"});
  EXPECT_EQ(left.controlEndpoints, std::vector<std::string>{"ipc:///r/control"});
  EXPECT_EQ(left.sensor.name, "left");
  const Config standard = completed({}, {.runtime = "/r"});
  EXPECT_EQ(standard.publish.latest, (std::vector<std::string>{"ipc:///r/latest", "tcp://127.0.0.1:9873"}));
  // Any user of the machine reaches a port, and zeroes.
  EXPECT_EQ(standard.controlEndpoints, std::vector<std::string>{"ipc:///r/control"});
  Config given;
  given.publish.stream = {"tcp://*:1"};
  given.sensor.name = "gel";
  given = completed(given, {.runtime = "/r"});
  EXPECT_EQ(given.publish.stream, std::vector<std::string>{"tcp://*:1"});
  EXPECT_EQ(given.sensor.name, "gel");
}

TEST(Instance, AdoptedGelFileIsTheOneOfTheStateDirectoryAndNoneBefore) {
  const Folder folder;
  const Places places{.state = folder / "", .runtime = "/r"};
  Config config;
  config.sensor.gelFile = kAdoptedGelFile;
  EXPECT_FALSE(config.sensor.namesGelFile());
  const std::string kept = places.state / "adopted.toml";
  EXPECT_EQ(completed(config, places).sensor.gelFile, kNoGelFile);
  EXPECT_EQ(completed(config, places).sensor.adopted, kept);
  std::ofstream(kept) << "format = 1\n";
  EXPECT_EQ(completed(config, places).sensor.gelFile, kept);
  // Whoever names another one does not have it replaced by a request.
  config.sensor.gelFile = "gel.toml";
  EXPECT_EQ(completed(config, places).sensor.gelFile, "gel.toml");
  EXPECT_EQ(completed(config, places).sensor.adopted, "");
}

TEST(OwnDirectory, IsMadeAndGoesWhenItIsEmpty) {
  const Folder folder;
  for (const bool isUsed : {false, true}) {
    {
      const auto own = OwnDirectory::claim(folder / "deep/run", "runtime directory");
      ASSERT_TRUE(own);
      EXPECT_TRUE(fs::is_directory(folder / "deep/run"));
      if (isUsed) fs::create_directory(folder / "deep/run/kept");
    }
    EXPECT_EQ(fs::exists(folder / "deep/run"), isUsed);
  }
}

TEST(OwnDirectory, IsNobodyElses) {
  const Folder folder;
  const auto first = OwnDirectory::claim(folder / "state", "state directory");
  ASSERT_TRUE(first);
  const auto second = OwnDirectory::claim(folder / "state", "state directory");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().exitCode, EX_TEMPFAIL);
  EXPECT_NE(second.error().message().find("state directory"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder / "state")) << "it is the first one's";
}

TEST(OwnDirectory, IsNoneThatAnotherUserControls) {
  const Folder folder;
  const auto refusedAt = [](const fs::path& path) {
    const auto own = OwnDirectory::claim(path, "runtime directory");
    return !own && own.error().exitCode == EX_NOPERM;
  };
  fs::create_directory(folder / "open");
  fs::create_directory_symlink(folder / "open", folder / "link");
  EXPECT_FALSE(refusedAt(folder / "open"));
  EXPECT_FALSE(refusedAt(folder / "open/"));
  EXPECT_FALSE(refusedAt(folder / "link"));
  fs::permissions(folder / "open", fs::perms::all | fs::perms::sticky_bit);
  EXPECT_TRUE(refusedAt(folder / "open"));
  EXPECT_TRUE(refusedAt(folder / "link"));
  EXPECT_FALSE(refusedAt(folder / "open/mine")) << "nobody else can rename it";
  fs::create_directory(folder / "open/tractiond-1000");
  EXPECT_FALSE(refusedAt(folder / "open/tractiond-1000/default"));
  fs::permissions(folder / "open/tractiond-1000", fs::perms::all);
  EXPECT_TRUE(refusedAt(folder / "open/tractiond-1000/default"));
  EXPECT_FALSE(fs::exists(folder / "open/tractiond-1000/default"));
  if (geteuid() != 0) return;  // cannot give directories away
  fs::permissions(folder / "open/tractiond-1000", fs::perms::owner_all);
  ASSERT_EQ(chown((folder / "open/tractiond-1000").c_str(), 65534, 65534), 0);
  EXPECT_TRUE(refusedAt(folder / "open/tractiond-1000"));
  EXPECT_TRUE(refusedAt(folder / "open/tractiond-1000/default"));
  ASSERT_EQ(lchown((folder / "link").c_str(), 65534, 65534), 0);
  fs::permissions(folder / "open", fs::perms::owner_all);
  EXPECT_FALSE(refusedAt(folder / "link")) << "who can write into the folder put it there";
}

TEST(OwnDirectory, ThatCannotBeMadeIsAnError) {
  const Folder folder;
  const auto file = folder / "file";
  std::ofstream(file) << "";
  for (const auto& path : {file, file / "below"}) {
    const auto own = OwnDirectory::claim(path, "state directory");
    ASSERT_FALSE(own);
    EXPECT_EQ(own.error().exitCode, EX_CANTCREAT);
  }
}

}  // namespace
}  // namespace tractiond::instance_test

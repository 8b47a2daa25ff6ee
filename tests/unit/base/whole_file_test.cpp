#include "base/whole_file.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

namespace tractiond::whole_file_test {
namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& path) {
  const auto bytes = readWholeFile(path);
  return bytes ? std::string(bytes->begin(), bytes->end()) : bytes.error().message();
}

TEST(WholeFile, UnfinishedOneOfBeforeIsReplacedWithItsMode) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "state", unfinished = folder.path() / "state.unfinished";
  std::ofstream(unfinished) << "half of it, by a kill";
  fs::permissions(unfinished, fs::perms::all);
  ASSERT_FALSE(replaceWholeFile(path, std::string_view("all"), 0600));
  EXPECT_EQ(textOf(path), "all");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_FALSE(fs::exists(unfinished));
  ASSERT_FALSE(replaceWholeFile(path, std::string_view("for all")));
  EXPECT_NE(fs::status(path).permissions() & fs::perms::owner_read, fs::perms::none);
  EXPECT_EQ(fs::status(path).permissions() & fs::perms::owner_exec, fs::perms::none);
}

TEST(WholeFile, NoLinkIsFollowed) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "state", other = folder.path() / "other";
  std::ofstream(other) << "of another user";
  for (const fs::path& link : {folder.path() / "state.unfinished", path}) {
    fs::remove(link);
    fs::create_symlink(other, link);
    ASSERT_FALSE(replaceWholeFile(path, std::string_view("all")));
    EXPECT_EQ(textOf(other), "of another user");
    EXPECT_EQ(textOf(path), "all");
    EXPECT_FALSE(fs::is_symlink(path));
  }
}

}  // namespace
}  // namespace tractiond::whole_file_test

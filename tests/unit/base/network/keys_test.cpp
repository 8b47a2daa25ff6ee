#include "base/network/keys.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <random>

namespace tractiond::network::keys_test {
namespace {

namespace fs = std::filesystem;

class KeysTest : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  static mode_t modeOf(const fs::path& path) {
    struct stat status {};
    EXPECT_EQ(stat(path.c_str(), &status), 0);
    return status.st_mode & 07777;
  }

  const test::TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
};

TEST_F(KeysTest, PairIsKeptForItsOwnerAlone) {
  KeyPair keys = newKeyPair();
  EXPECT_TRUE(isKey(keys.publicKey));
  EXPECT_NE(keys.publicKey, newKeyPair().publicKey);
  keys.serverKey = newKeyPair().publicKey;
  const fs::path path = folder_ / "made" / "key";
  ASSERT_TRUE(saveKeyPair(path, keys));
  EXPECT_EQ(modeOf(path), 0600U);
  const auto loaded = loadKeyPair(path);
  ASSERT_TRUE(loaded) << loaded.error().message();
  EXPECT_EQ(loaded->publicKey, keys.publicKey);
  EXPECT_EQ(loaded->secretKey, keys.secretKey);
  EXPECT_EQ(loaded->serverKey, keys.serverKey);
  const auto again = saveKeyPair(path, newKeyPair());
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().exitCode, EX_CANTCREAT);
  EXPECT_EQ(loadKeyPair(path)->secretKey, keys.secretKey);
  ASSERT_EQ(chmod(path.c_str(), 0644), 0);
  EXPECT_EQ(loadKeyPair(path).error().exitCode, EX_NOPERM);
}

TEST_F(KeysTest, ModesDoNotDependOnTheUmask) {
  const fs::path parent = folder_ / "etc", keys = parent / "keys", others = folder_ / "others";
  const mode_t before = umask(077);
  const bool isAllowed = allow(keys, {"ada", newKeyPair().publicKey, Permission::kRead}).has_value();
  const bool isSaved = saveServerKey(keys, newKeyPair()).has_value() && saveServerKey(others, newKeyPair());
  umask(before);
  ASSERT_TRUE(isAllowed && isSaved);
  EXPECT_EQ(modeOf(keys / "ada.key"), 0644U);
  EXPECT_EQ(modeOf(serverKeyFile(keys)), geteuid() == 0 ? 0640U : 0600U);  // root's is for the gateway's group
  EXPECT_TRUE(loadKeyPair(serverKeyFile(keys)));
  for (const fs::path& directory : {parent, keys, others}) EXPECT_EQ(modeOf(directory), 0755U);
}

TEST_F(KeysTest, DirectoryIsLookedAtAnew) {
  KeyDirectory directory(folder_);
  directory.refresh();
  EXPECT_TRUE(directory.keys().empty());
  EXPECT_TRUE(directory.faults().empty());

  const std::string ada = newKeyPair().publicKey, bob = newKeyPair().publicKey;
  ASSERT_TRUE(allow(folder_, {"ada", ada, Permission::kRead}));
  ASSERT_TRUE(allow(folder_, {"bob", bob, Permission::kControl}));
  EXPECT_TRUE(directory.refresh());
  EXPECT_FALSE(directory.refresh());
  ASSERT_NE(directory.find(ada), nullptr);
  EXPECT_EQ(*directory.find(bob), (AllowedKey{"bob", bob, Permission::kControl}));

  ASSERT_TRUE(allow(folder_, {"ada", ada, Permission::kControl}));
  EXPECT_TRUE(directory.refresh());
  EXPECT_EQ(directory.find(ada)->permission, Permission::kControl);

  ASSERT_TRUE(revoke(folder_, "ada"));
  EXPECT_TRUE(directory.refresh());
  EXPECT_EQ(directory.find(ada), nullptr);
  EXPECT_NE(directory.find(bob), nullptr);
  EXPECT_EQ(revoke(folder_, "ada").error().exitCode, EX_NOINPUT);

  fs::remove_all(folder_);
  EXPECT_TRUE(directory.refresh());
  EXPECT_TRUE(directory.keys().empty());
  ASSERT_EQ(directory.faults().size(), 1U);
  EXPECT_FALSE(directory.refresh()) << "is told once";
}

/// Whoever can write there lets himself in.
TEST_F(KeysTest, WhatAnybodyCanWriteAllowsNobody) {
  const std::string key = newKeyPair().publicKey;
  ASSERT_TRUE(allow(folder_, {"ada", key, Permission::kRead}));
  KeyDirectory directory(folder_);
  directory.refresh();
  ASSERT_NE(directory.find(key), nullptr);
  for (const fs::path& open : {folder_, folder_ / "ada.key"}) {
    const auto before = static_cast<fs::perms>(modeOf(open));
    fs::permissions(open, before | fs::perms::others_write);
    EXPECT_TRUE(directory.refresh()) << open;
    EXPECT_EQ(directory.find(key), nullptr) << open;
    ASSERT_EQ(directory.faults().size(), 1U);
    EXPECT_EQ(directory.faults()[0].exitCode, EX_NOPERM);
    EXPECT_EQ(directory.faults()[0].where, open);
    EXPECT_FALSE(directory.refresh()) << "is told once";
    fs::permissions(open, before);
    EXPECT_TRUE(directory.refresh()) << open;
    EXPECT_NE(directory.find(key), nullptr) << open;
  }
}

TEST_F(KeysTest, WhatIsNoKeyAllowsNobodyAndIsNamedInALine) {
  std::mt19937 random(test::seed());
  const std::string key = newKeyPair().publicKey;
  const std::string good = "key = \"" + key + "\"\npermission = \"control\"\n";
  ASSERT_TRUE(allow(folder_, {"good", newKeyPair().publicKey, Permission::kRead}));
  mkfifo((folder_ / "pipe.key").c_str(), 0600);
  fs::create_directory(folder_ / "folder.key");
  fs::create_symlink("/dev/zero", folder_ / "zero.key");
  fs::create_symlink("/nowhere", folder_ / "nothing.key");
  put("empty.key", "");
  put("no name.key", good);
  put("unknown.key", good + "extra = 1\n");
  put("whoever.key", "key = \"" + key + "\"\npermission = \"root\"\n");
  put("short.key", "key = \"" + key.substr(1) + "\"\npermission = \"read\"\n");
  fs::resize_file((put("huge.key", good), folder_ / "huge.key"), std::uintmax_t{1} << 40);  // sparse
  put("ignored.txt", "anything");
  std::string junk(random() % 5000, '\0');
  for (char& c : junk) c = static_cast<char>(random());
  put("junk.key", junk);
  put("cut.key", good.substr(0, random() % (good.size() - 2)));
  KeyDirectory directory(folder_);
  directory.refresh();
  ASSERT_EQ(directory.keys().size(), 1U);
  EXPECT_EQ(directory.keys()[0].name, "good");
  EXPECT_EQ(directory.faults().size(), 12U);
  for (const Error& fault : directory.faults()) {
    EXPECT_NE(fault.message().find(".key"), std::string::npos) << fault.message();
    EXPECT_EQ(fault.message().find('\n'), std::string::npos) << fault.message();
  }
}

}  // namespace
}  // namespace tractiond::network::keys_test

// The main() of tests that open a camera. GigE Vision's port is exclusive per address, so they start themselves again
// in a network namespace that holds nothing but a loopback, unless they only list their tests.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace {

/// Comes back inside the namespace, or ends the program with a message.
void enterOwnNetwork(int argc, char** argv) {
  constexpr const char* kOutside = "TRACTION_OUTER_NETWORK";
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]).starts_with("--gtest_list_tests")) return;
  const std::string network = std::filesystem::read_symlink("/proc/self/ns/net");
  const char* const outside = std::getenv(kOutside);
  if (outside != nullptr && std::string_view(outside).starts_with("net:[") && network != outside) return;
  setenv(kOutside, network.c_str(), 1);
  static std::array<char, 4096> self{};
  if (readlink("/proc/self/exe", self.data(), self.size() - 1) < 0) std::exit(EXIT_FAILURE);
  static char program[] = "unshare", flags[] = "-rn", shell[] = "sh", command[] = "-c";
  static char script[] = "ip link set lo up && ip address add 127.0.0.2/8 dev lo && exec \"$0\" \"$@\"";
  std::vector<char*> arguments{program, flags, shell, command, script, self.data()};
  arguments.insert(arguments.end(), argv + 1, argv + argc);
  arguments.push_back(nullptr);
  execvp("unshare", arguments.data());
  std::perror("unshare");
  std::exit(EXIT_FAILURE);
}

}  // namespace

int main(int argc, char** argv) {
  enterOwnNetwork(argc, argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

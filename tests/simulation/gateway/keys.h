// The keys of a gateway's clients, as files on the simulated disk that an administrator removes and changes.
#pragma once

#include "base/network/keys.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/story.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::simulation {

class Keys {
 public:
  static constexpr const char* kDirectory = "/keys";
  static constexpr int kCount = 4;
  /// Names of the keys; the second and the third one allow requests.
  static constexpr std::array<const char*, kCount> kNames = {"viewer", "robot", "panel", "logger"};

  /// Writes the gateway's own key and all others. Both references must outlive it.
  Keys(Disk& disk, Journal& journal);

  /// Changes a key for a while, as the event says.
  void heed(const Happening& one);
  /// Takes back what is over.
  void turn();
  /// Returns when turn() has something to do; kNever: it has not.
  std::int64_t next_ns() const;

  /// Returns the key of a client, 32 bytes. \param key 0 to kCount - 1; any other one is not allowed
  static std::string bytesOf(int key);
  /// Returns what a key allows while nothing has changed it.
  static network::Permission usual(int key);
  /// Returns what a key allows; nothing if it is not allowed.
  std::optional<network::Permission> permissionOf(int key) const;
  /// Returns when that changed last.
  std::int64_t changed_ns(int key) const;

 private:
  enum class State { kWhole, kDemoted, kGarbled, kRevoked };
  struct Change {
    int key;
    State to;
    std::int64_t until_ns;
  };

  void settle(int key);

  Disk& disk_;
  Journal& journal_;
  std::vector<Change> changes_;
  std::array<State, kCount> states_{};
  std::array<std::int64_t, kCount> changed_ns_{};
};

}  // namespace tractiond::simulation

// Six axes as spacenavd serves those of a 3-D mouse: for any program on libspnav, such as Blender and FreeCAD.
#pragma once

#include "base/error.h"
#include "client/input/affine.h"
#include "client/input/touches.h"

#include <tl/expected.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace traction::input {

/// Returns the path of the socket where libspnav looks if SPNAV_SOCKET and /etc/spnavrc name no other; that of a user
/// other than root is in $XDG_RUNTIME_DIR.
std::filesystem::path spacenavSocket();

/// Serves version 0 of the protocol: events of eight numbers of 32 bits each. Thread-bound.
class Spacenav : public Output {
 public:
  /// Makes the socket; root's admits the programs of all users. Errors: EX_UNAVAILABLE if a program, such as spacenavd,
  /// listens there; as tractiond::network::checkEndpoint(); EX_CANTCREAT if the socket cannot be made.
  static tl::expected<std::unique_ptr<Spacenav>, tractiond::Error> open(const std::filesystem::path& path,
                                                                        const AxesOptions& options);
  ~Spacenav() override;
  Spacenav(const Spacenav&) = delete;

  /// Sends the axes while one is not 0, and once when all are.
  void write(const Touches& touches) override;
  /// Admits new clients, and sends what a client could not take before.
  void turn(std::int64_t now_ns) override;

 private:
  using Axes = std::array<std::int32_t, 6>;
  /// Turns in which a new client may ask for a version of the protocol: it takes what comes first for the answer.
  static constexpr int kTurnsToAsk = 20;

  /// A program.
  struct Client {
    int descriptor = -1;
    int turnsLeft = kTurnsToAsk;  ///< before it is sent anything
    float sensitivity = 1.0F;     ///< factor of its axes
    Axes sent{};
  };

  Spacenav(int descriptor, std::filesystem::path path, const AxesOptions& options);

  /// Reads what a client says. Returns false if it has gone.
  static bool hear(Client& client);
  /// Returns false if it has gone.
  bool tell(Client& client) const;

  int descriptor_;
  std::filesystem::path path_;
  AxesOptions options_;
  std::vector<Client> clients_;
  Axes axes_{};
  std::int32_t period_ms_ = 0;  ///< between the last two fields
  std::int64_t time_ns_ = 0;    ///< of the last field
};

}  // namespace traction::input

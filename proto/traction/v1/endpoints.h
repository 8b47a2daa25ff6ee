// Names, topics, endpoints and directories of an instance of tractiond, and of traction-touch, which follows its
// contacts: the same for the programs and their clients.
#pragma once

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace traction {

/// Name of the instance that is meant where no name is given.
inline constexpr const char* kDefaultInstance = "default";

/// Longest name of a sensor or an instance [bytes]. The topic of a longer name would not fit the 64 bytes that the
/// publisher accepts as a subscription.
inline constexpr std::size_t kMaxNameLength = 24;

/// Returns whether `name` is valid for a sensor or an instance: 1 to kMaxNameLength characters of A-Z a-z 0-9 _ -.
inline bool isValidName(std::string_view name) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  return !name.empty() && name.size() <= kMaxNameLength && name.find_first_not_of(kAllowed) == std::string_view::npos;
}

/// Start of all topics of this version of the protocol.
inline constexpr std::string_view kTopicRoot = "traction/v1/";

/// Kinds of messages, as topics have them. Clients number them in this order.
inline constexpr std::array<std::string_view, 7> kTopicKinds = {"field",   "markers",  "description", "status",
                                                                "preview", "contacts", "grasp"};

/// Returns the topic "traction/v1/SENSOR/KIND/". `kind` is one of kTopicKinds; neither argument is checked. Because of
/// the slash at the end no topic is the start of another one, which a subscription would also receive.
inline std::string topicOf(std::string_view sensor, std::string_view kind) {
  return std::string(kTopicRoot) + std::string(sensor) + "/" + std::string(kind) + "/";
}

/// ZeroMQ endpoints of an instance, such as "tcp://127.0.0.1:9872"; empty: none.
struct Endpoints {
  std::string stream;   ///< XPUB: every message: [topic][protobuf][seconds since the epoch as text]
  std::string latest;   ///< PUB: the newest field alone, one part, conflated
  std::string control;  ///< ROUTER: the requests of control.proto and their answers
};

/// TCP ports on the loopback interface, used by the instance "default" alone; other instances have IPC endpoints only.
/// There is no port for control: every user of the machine can reach a port, but only the group of the socket file may
/// change what is measured. 9872 is the default port of PlotJuggler.
inline constexpr int kStreamPort = 9872;
inline constexpr int kLatestPort = 9873;
/// Of traction-touch's stream, also for the instance "default" alone. 9875 is that of traction-metrics.
inline constexpr int kTouchPort = 9876;

/// Names of the programs that publish, each in runtime directories of its own.
inline constexpr std::string_view kDaemon = "tractiond", kTouch = "traction-touch";

/// Returns the TCP endpoints of the instance "default", on 127.0.0.1; `control` is empty.
inline Endpoints tcpEndpoints() {
  const std::string host = "tcp://127.0.0.1:";
  return {host + std::to_string(kStreamPort), host + std::to_string(kLatestPort), ""};
}

/// Returns the TCP endpoint of traction-touch of the instance "default"; its only socket is a stream.
inline Endpoints touchTcpEndpoints() {
  return {"tcp://127.0.0.1:" + std::to_string(kTouchPort), "", ""};
}

/// Default TCP port of the stream of a traction-gateway; the next two are those of latest and control.
inline constexpr int kGatewayPort = 9882;

/// Returns the IPC endpoints in the runtime directory of an instance. Does not access the disk.
inline Endpoints ipcEndpoints(const std::filesystem::path& runtimeDirectory) {
  const std::string ipc = "ipc://" + runtimeDirectory.string();
  return {ipc + "/stream", ipc + "/latest", ipc + "/control"};
}

/// Returns the two directories that may be an instance's runtime directory. The first is the user's:
/// $XDG_RUNTIME_DIR/PROGRAM/INSTANCE, or /tmp/PROGRAM-UID/INSTANCE if that variable is not an absolute path. The
/// second is the system's: /run/PROGRAM/INSTANCE. A client uses the first one that exists. A program without
/// $RUNTIME_DIRECTORY uses the second one if it runs as root, else the first. Does not access the disk.
inline std::vector<std::filesystem::path> runtimeDirectories(const std::string& instance,
                                                             std::string_view program = kDaemon) {
  const char* ofUser = std::getenv("XDG_RUNTIME_DIR");
  const std::string name(program);
  const auto own = ofUser != nullptr && *ofUser == '/'
                       ? std::filesystem::path(ofUser) / name
                       : std::filesystem::path("/tmp") / (name + "-" + std::to_string(getuid()));
  return {own / instance, std::filesystem::path("/run") / name / instance};
}

/// Returns the runtime directory of the traction-touch beside a tractiond with this one: /run/traction-touch/INSTANCE
/// for /run/tractiond/INSTANCE. Empty: the directory is not one of runtimeDirectories(). Does not access the disk.
inline std::filesystem::path touchDirectoryBeside(const std::filesystem::path& runtimeDirectory) {
  const std::filesystem::path program = runtimeDirectory.parent_path();
  return program.filename() == kDaemon ? program.parent_path() / kTouch / runtimeDirectory.filename()
                                       : std::filesystem::path();
}

}  // namespace traction

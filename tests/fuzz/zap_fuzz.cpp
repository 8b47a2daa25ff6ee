#include "gateway/handshake.h"
#include "tests/fuzz/target.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace fuzz {

using tractiond::network::AllowedKey;
using tractiond::network::Permission;

namespace {

/// 32 different bytes from `first` on.
std::string bytesOfKey(char first) {
  std::string bytes(32, '\0');
  std::iota(bytes.begin(), bytes.end(), first);
  return bytes;
}

const std::array<AllowedKey, 2>& allowed() {
  static const std::array<AllowedKey, 2> keys = {
      {{"ada", tractiond::network::keyOfBytes(bytesOfKey(1)), Permission::kControl},
       {"reader", tractiond::network::keyOfBytes(bytesOfKey(64)), Permission::kRead}}};
  return keys;
}

/// Each with its length in a byte before it.
std::string framed(const std::vector<std::string>& parts) {
  std::string bytes;
  for (const std::string& part : parts) bytes += static_cast<char>(part.size()) + part;
  return bytes;
}

std::vector<std::string> parts(std::string_view bytes) {
  std::vector<std::string> all;
  while (!bytes.empty()) {
    const std::size_t size = static_cast<unsigned char>(bytes[0]);
    all.emplace_back(bytes.substr(1, size));
    bytes.remove_prefix(std::min(bytes.size(), 1 + size));
  }
  return all;
}

}  // namespace

std::vector<std::string> seeds() {
  return {framed({"1.0", "1", "control", "192.0.2.1", "", "CURVE", bytesOfKey(1)}),
          framed({"1.0", "2", "stream", "192.0.2.1", "", "CURVE", bytesOfKey(64)})};
}

/// Of any frames: an answer of six to the same request, and nobody is let in but by a key that may.
bool feed(std::string_view bytes) {
  const std::vector<std::string> request = parts(bytes);
  const AllowedKey* asked = nullptr;
  const auto answer = tractiond::gateway::answerHandshake(request, [&asked](const std::string& key) {
    for (const AllowedKey& one : allowed()) {
      if (one.key == key) asked = &one;
    }
    return asked;
  });
  for (std::size_t i = 0; i < 2; ++i) {
    require(answer.parts[i] == (i < request.size() ? request[i] : ""), "it answers another request");
  }
  const bool letIn = answer.parts[2] == "200";
  require(letIn || answer.parts[2] == "400", "it is neither yes nor no");
  require(letIn == answer.refused.empty(), "people are told otherwise");
  require(answer.parts[4] == (letIn && asked != nullptr ? asked->name : ""), "it names another user");
  if (!letIn) return false;
  require(request.size() == 7 && request[5] == "CURVE", "it is no handshake with a key");
  require(asked != nullptr && tractiond::network::keyOfBytes(request[6]) == asked->key, "the key is nobody's");
  require(request[2] != "control" || asked->permission == Permission::kControl, "a reader may control");
  return true;
}

}  // namespace fuzz

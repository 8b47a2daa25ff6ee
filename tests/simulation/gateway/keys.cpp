#include "tests/simulation/gateway/keys.h"

#include <fmt/format.h>
#include <zmq.h>

#include <algorithm>

namespace tractiond::simulation {
namespace {

constexpr std::size_t kLetters = 40;

std::string textOf(const std::string& bytes) {
  std::array<char, kLetters + 1> letters{};
  zmq_z85_encode(letters.data(), reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return letters.data();
}

std::string fileOf(int key) {
  return fmt::format("{}/{}.key", Keys::kDirectory, Keys::kNames.at(static_cast<std::size_t>(key)));
}

}  // namespace

Keys::Keys(Disk& disk, Journal& journal)
    : disk_(disk)
    , journal_(journal) {
  const std::string secret = textOf(bytesOf(99));
  std::array<char, kLetters + 1> own{};
  zmq_curve_public(own.data(), secret.c_str());
  disk_.put(network::serverKeyFile(kDirectory).string(),
            fmt::format("public = \"{}\"\nsecret = \"{}\"\n", own.data(), secret));
  for (int key = 0; key < kCount; ++key) settle(key);
  changed_ns_.fill(now() - 100 * kSecond);
}

std::string Keys::bytesOf(int key) {
  return std::string(32, static_cast<char>('A' + key));
}

network::Permission Keys::usual(int key) {
  return key == 1 || key == 2 ? network::Permission::kControl : network::Permission::kRead;
}

std::optional<network::Permission> Keys::permissionOf(int key) const {
  if (key < 0 || key >= kCount) return std::nullopt;
  const State state = states_[static_cast<std::size_t>(key)];
  if (state == State::kRevoked || state == State::kGarbled) return std::nullopt;
  return state == State::kDemoted ? network::Permission::kRead : usual(key);
}

std::int64_t Keys::changed_ns(int key) const {
  return key < 0 || key >= kCount ? 0 : changed_ns_[static_cast<std::size_t>(key)];
}

/// Writes or removes the file of a key. Of several changes that last the strictest one holds.
void Keys::settle(int key) {
  State state = State::kWhole;
  for (const Change& one : changes_) {
    if (one.key == key) state = std::max(state, one.to);
  }
  states_[static_cast<std::size_t>(key)] = state;
  changed_ns_[static_cast<std::size_t>(key)] = now();
  const std::string file = fileOf(key);
  if (disk_.inodeOf(file)) disk_.unlink(file);
  if (state == State::kRevoked) return;
  const std::string permission(network::wordOf(permissionOf(key).value_or(network::Permission::kRead)));
  disk_.put(file, state == State::kGarbled
                      ? "key = \"none\"\n"
                      : fmt::format("key = \"{}\"\npermission = \"{}\"\n", textOf(bytesOf(key)), permission));
}

void Keys::heed(const Happening& one) {
  if (one.event != Event::kRevoked && one.event != Event::kDemoted && one.event != Event::kGarbledKey) return;
  const auto key = static_cast<int>(one.amount);
  const State to = one.event == Event::kRevoked   ? State::kRevoked
                   : one.event == Event::kDemoted ? State::kDemoted
                                                  : State::kGarbled;
  const std::array words = {"whole", "for reading alone", "garbled", "removed"};
  journal_.say(fmt::format("the key of {} is {}", kNames.at(static_cast<std::size_t>(key)),
                           words.at(static_cast<std::size_t>(to))));
  changes_.push_back({key, to, now() + one.for_ms * kMs});
  settle(key);
}

void Keys::turn() {
  for (std::size_t i = 0; i < changes_.size();) {
    if (changes_[i].until_ns > now()) {
      ++i;
      continue;
    }
    const int key = changes_[i].key;
    changes_.erase(changes_.begin() + static_cast<std::ptrdiff_t>(i));
    journal_.say(fmt::format("the key of {} is mended", kNames.at(static_cast<std::size_t>(key))));
    settle(key);
  }
}

std::int64_t Keys::next_ns() const {
  std::int64_t next = kNever;
  for (const Change& one : changes_) next = std::min(next, one.until_ns);
  return next;
}

}  // namespace tractiond::simulation

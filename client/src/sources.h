// Tells apart the programs that publish under one name.
#pragma once

#include "base/printable.h"
#include "traction/subscriber.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace traction {

/// A daemon that is started anew has another boot, and the one before does not come back. Where it does, two daemons
/// have one sensor.name, and their messages alternate: the name belongs to the one that was heard first. The same holds
/// of the runs of traction-touch. Thread-bound.
class Sources {
 public:
  /// Time without a message after which a source has lost its name [ns]: a daemon sends its status once a second.
  static constexpr std::int64_t kGone_ns = 2'500'000'000;

  /// Takes the next message. Returns whether it is of the source that has the name. The first message of another source
  /// is taken for that of a restart: it becomes clear with the next one of the first source.
  /// \param now_ns when the message came, on any clock
  bool take(const Message& message, std::int64_t now_ns) {
    const auto& [key, id] = identityOf(message);
    Name& name = names_[key];
    if (name.ids.empty() || name.ids.back() != id) {
      if (seconds_.contains({key, id}) && now_ns - name.heard_ns < kGone_ns) return false;
      const auto known = std::find(name.ids.begin(), name.ids.end(), id);
      if (known == name.ids.end()) {
        name.ids.push_back(id);
      } else {
        ++returns_;
        tell(key, id, *std::next(known));
        for (auto each = std::next(known); each != name.ids.end(); ++each) seconds_.emplace(key, *each);
        name.ids.erase(std::next(known), name.ids.end());
      }
    }
    name.heard_ns = now_ns;
    return true;
  }

  /// Returns whether a message is of a source that is second under its name, as far as take() has found out: for
  /// another reading of the same messages.
  bool isSecond(const Message& message) const { return !seconds_.empty() && seconds_.contains(identityOf(message)); }

  /// Returns how often a source was heard again after another one of its name.
  std::uint64_t returns() const { return returns_; }
  /// Returns a sentence that names the first two sources of one name; empty: none have one.
  const std::string& trouble() const { return trouble_; }

 private:
  using Key = std::pair<std::size_t, std::string>;  ///< what publishes, and for which sensor or hand
  struct Name {
    std::vector<Id> ids;  ///< one after the other
    std::int64_t heard_ns = 0;
  };

  static std::pair<Key, Id> identityOf(const Message& message) {
    const Header& header = std::visit([](const auto& any) -> const Header& { return any.header; }, message);
    const auto* contacts = std::get_if<Contacts>(&message);
    const bool isOfTouch = contacts != nullptr || std::holds_alternative<Grasp>(message);
    return {{isOfTouch ? message.index() : 0, header.sensor}, contacts != nullptr ? contacts->run : header.boot};
  }

  void tell(const Key& key, const Id& first, const Id& second) {
    if (!trouble_.empty()) return;
    const auto hex = [](const Id& id) {
      std::string text(8, ' ');
      std::snprintf(text.data(), text.size() + 1, "%02x%02x%02x%02x", id[0], id[1], id[2], id[3]);
      return text;
    };
    trouble_ = "two sources are called '" + printable(key.second) + "' at once (boot or run " + hex(first) +
               "... and " + hex(second) + "...); what the second one sends is left out: give each its sensor.name";
  }

  std::map<Key, Name> names_;
  std::set<std::pair<Key, Id>> seconds_;
  std::uint64_t returns_ = 0;
  std::string trouble_;
};

}  // namespace traction

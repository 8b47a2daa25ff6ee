// Finds two sources of one name in a recording.
#pragma once

#include "client/src/sources.h"
#include "recording/reader.h"

#include <string_view>

namespace traction::client {

/// Reads a recording once, for who sent what. What is wrong with the file says the reading that follows.
inline Sources sourcesOf(const recording::Reader& reader, const std::stop_token& stop = {}) {
  Sources sources;
  const auto visit = [&](const recording::Channel& channel, const recording::Schema*,
                         const recording::Message& record) {
    const std::string_view topic = channel.topic;
    if (!topic.ends_with("/field/") && !topic.ends_with("/status/") && !topic.ends_with("/contacts/")) return;
    try {
      if (const auto message = decode(Raw{topic, record.data}))
        sources.take(*message, static_cast<std::int64_t>(record.logTime_ns));
    } catch (const Error&) {  // the reading that follows says so
    }
  };
  (void)reader.read(visit, 0, stop);
  return sources;
}

/// Returns whether a message is of a source that is second under its name.
inline bool isSecond(const Sources& sources, const recording::Channel& channel, const recording::Message& record) {
  if (sources.trouble().empty()) return false;
  try {
    const auto message = decode(Raw{channel.topic, record.data});
    return message && sources.isSecond(*message);
  } catch (const Error&) {
    return false;
  }
}

}  // namespace traction::client

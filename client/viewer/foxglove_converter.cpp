#include "client/viewer/foxglove_converter.h"

#include "client/files/message_header.h"
#include "client/viewer/frame.h"
#include "proto/traction/v1/descriptors.h"
#include "proto/traction/v1/endpoints.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace traction::view::foxglove {

namespace {

constexpr std::size_t kMostSensors = 64;  ///< of one source; limits the memory if a publisher sends endless names

std::uint64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

}  // namespace

std::string topicOf(const std::string& sensor, const ChannelType& type) {
  if (type.kind < kDrawn) return traction::topicOf(sensor, type.name);
  return "foxglove/" + sensor + "/" + std::string(type.name);
}

std::string_view schemaOf(const ChannelType& type) {
  return type.kind >= kDrawn ? client::foxglove::descriptors() : descriptors();
}

void Converter::pass(const Message& message, const Raw& raw) {
  const std::string& sensor = client::headerOf(message).sensor;
  if (!isValidName(sensor) || (drawings_.size() >= kMostSensors && !drawings_.contains(sensor))) return;
  const unsigned wanted = wanted_;
  const unsigned kind = kindOf(message);
  const bool isLasting = (kind & (unsigned{kDescription} | kStatus)) != 0;
  Sample sample{.sensor = sensor, .kind = kind, .isLasting = isLasting, .logTime_ns = now_ns(), .data = nullptr};
  const bool isAsSent = !raw.topic.empty() || kind != kContacts;  // else the library's own ends of contacts
  if (isAsSent && (isLasting || (wanted & kind) != 0)) {
    sample.data = std::make_shared<const std::string>(raw.bytes);
    deliver_(sample);
  }

  const bool isDescription = kind == kDescription;
  const unsigned drawings = (wanted | (isDescription ? kScenes : 0U)) / kDrawn;
  for (client::foxglove::Drawn& drawn :
       drawings_.try_emplace(sensor, sensor)
           .first->second.draw(message, client::captureTime_ns(message, sample.logTime_ns), drawings)) {
    const auto* type = std::find_if(kChannelTypes.begin(), kChannelTypes.end(),
                                    [&](const ChannelType& each) { return each.name == drawn.topic; });
    if (type == kChannelTypes.end()) continue;
    sample.kind = type->kind;
    sample.slot = isDescription ? 1 : kind == kContacts ? 2 : 0;
    sample.isLasting = isDescription;
    sample.data = std::make_shared<const std::string>(std::move(drawn.data));
    deliver_(sample);
  }
}

}  // namespace traction::view::foxglove

#include "client/viewer/foxglove_converter.h"

#include "client/files/message_header.h"
#include "proto/traction/v1/descriptors.h"
#include "proto/traction/v1/endpoints.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace traction::view::foxglove {

namespace {

constexpr std::size_t kMostSensors = 64;  ///< of one source; limits the memory if a publisher sends endless names

bool isDrawn(const ChannelType& type) {
  return (type.kind & ~static_cast<unsigned>(kAllTopics | kPreview | kContacts)) != 0;
}

unsigned kindOf(const Message& message) {
  constexpr std::array<unsigned, 7> kKinds = {kFields, kMarkerLists, kDescriptions, kStatuses, kPreviews, kContactLists,
                                              0};  // as in Message; a grasp has no channel
  return kKinds.at(message.index());
}

/// Returns the drawings that channels of these kinds need.
unsigned drawingsOf(unsigned kinds) {
  unsigned drawings = 0;
  if ((kinds & kScenes) != 0) drawings |= client::foxglove::kScene;
  if ((kinds & kGrids) != 0) drawings |= client::foxglove::kGrid;
  if ((kinds & kPictures) != 0) drawings |= client::foxglove::kPicture;
  if ((kinds & kLogs) != 0) drawings |= client::foxglove::kLog;
  return drawings;
}

std::uint64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

}  // namespace

std::string topicOf(const std::string& sensor, const ChannelType& type) {
  if (!isDrawn(type)) return traction::topicOf(sensor, type.name);
  return "foxglove/" + sensor + "/" + std::string(type.name);
}

std::string_view schemaOf(const ChannelType& type) {
  return isDrawn(type) ? client::foxglove::descriptors() : descriptors();
}

void Converter::pass(const Message& message, const Raw& raw) {
  const std::string& sensor = client::headerOf(message).sensor;
  if (!isValidName(sensor)) return;
  const unsigned wanted = wanted_;
  const unsigned kind = kindOf(message);
  const bool isLasting = (kind & (kDescriptions | kStatuses)) != 0;
  Sample sample{.sensor = sensor, .kind = kind, .isLasting = isLasting, .logTime_ns = now_ns(), .data = nullptr};
  const bool isAsSent = !raw.topic.empty() || kind != kContactLists;  // else the library's own ends of contacts
  if (isAsSent && (isLasting || (wanted & kind) != 0)) {
    sample.data = std::make_shared<const std::string>(raw.bytes);
    deliver_(sample);
  }

  auto drawing = drawings_.find(sensor);
  if (drawing == drawings_.end()) {
    if (drawings_.size() >= kMostSensors) return;
    drawing = drawings_.try_emplace(sensor, sensor).first;
  }
  const bool isDescription = kind == kDescriptions;
  const unsigned drawings = drawingsOf(wanted | (isDescription ? kScenes : 0U));
  for (client::foxglove::Drawn& drawn :
       drawing->second.draw(message, client::captureTime_ns(message, sample.logTime_ns), drawings)) {
    const auto* type = std::find_if(kChannelTypes.begin(), kChannelTypes.end(),
                                    [&](const ChannelType& each) { return each.name == drawn.topic; });
    if (type == kChannelTypes.end()) continue;
    sample.kind = type->kind;
    sample.slot = isDescription ? 1 : kind == kContactLists ? 2 : 0;
    sample.isLasting = isDescription;
    sample.data = std::make_shared<const std::string>(std::move(drawn.data));
    deliver_(sample);
  }
}

}  // namespace traction::view::foxglove

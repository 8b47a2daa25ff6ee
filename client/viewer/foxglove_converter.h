// The channels of a sensor on the Foxglove WebSocket, and the conversion of its messages to them.
#pragma once

#include "client/show/foxglove.h"
#include "traction/subscriber.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace traction::view::foxglove {

/// One channel each of a sensor; or-ed: Topics, of the messages as published, and Drawings, times kDrawn.
enum Kinds : unsigned {
  kDrawn = 256,
  kScenes = kDrawn * client::foxglove::kScene,
  kGrids = kDrawn * client::foxglove::kGrid,
  kPictures = kDrawn * client::foxglove::kPicture,
  kLogs = kDrawn * client::foxglove::kLog,
  kOfPreviews = kPreview | kPictures,  ///< the daemon makes previews only while they are subscribed to
};

struct ChannelType {
  unsigned kind = 0;
  std::string_view name;        ///< last part of the topic
  std::string_view schemaName;  ///< of a Protobuf message
};
inline constexpr std::array<ChannelType, 10> kChannelTypes = {{{kField, "field", "traction.v1.Field"},
                                                               {kMarkers, "markers", "traction.v1.Markers"},
                                                               {kDescription, "description", "traction.v1.Description"},
                                                               {kStatus, "status", "traction.v1.Status"},
                                                               {kPreview, "preview", "traction.v1.Preview"},
                                                               {kContacts, "contacts", "traction.v1.Contacts"},
                                                               {kScenes, "scene", "foxglove.SceneUpdate"},
                                                               {kGrids, "grid", "foxglove.Grid"},
                                                               {kPictures, "picture", "foxglove.RawImage"},
                                                               {kLogs, "log", "foxglove.Log"}}};

/// Returns the topic of a sensor's channel: "traction/v1/SENSOR/field/", "foxglove/SENSOR/scene". The name is not
/// checked.
std::string topicOf(const std::string& sensor, const ChannelType& type);
/// Returns a serialised FileDescriptorSet that defines the channel's message, with all that it imports; it lives as
/// long as the program. Reentrant.
std::string_view schemaOf(const ChannelType& type);

/// A message for the subscribers of one channel.
struct Sample {
  std::string sensor;  ///< name in the daemon's configuration
  unsigned kind = 0;   ///< one bit of Kinds
  /// Messages of a channel that replace each other have the same slot: the gel, the forces and the contacts of
  /// traction-touch of a scene have three, as a client keeps all.
  unsigned slot = 0;
  bool isLasting = false;        ///< valid until the next one of its slot: each new subscriber receives it at once
  std::uint64_t logTime_ns = 0;  ///< when it was converted [ns since 1970]
  std::shared_ptr<const std::string> data;  ///< Protobuf message; never null
};

/// Converts the messages of one source to samples of the channels that are wanted. Thread-bound except for want().
class Converter {
 public:
  using Deliver = std::function<void(const Sample& sample)>;

  /// \param deliver called by pass(), on its thread
  explicit Converter(Deliver deliver)
      : deliver_(std::move(deliver)) {}

  /// Sets the kinds of samples to make, instead of those of the last call; none at first. Descriptions, statuses and
  /// the gel of the scene are always made: they are rare, and lasting. Thread-safe.
  void want(unsigned kinds) { wanted_ = kinds; }

  /// Calls `deliver` on this thread, before it returns, with each sample of the message that is to be made: the message
  /// as published, and its drawings. Must be called with every message, as Drawing::draw(). Ignores a message whose
  /// sensor has an invalid name, or is not among the first 64.
  /// \param raw topic and bytes of `message`
  void pass(const Message& message, const Raw& raw);

 private:
  Deliver deliver_;
  std::atomic<unsigned> wanted_{0};
  std::map<std::string, client::foxglove::Drawing> drawings_;  ///< by sensor
};

}  // namespace traction::view::foxglove

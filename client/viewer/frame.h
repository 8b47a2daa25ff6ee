// Messages to browsers.
#pragma once

#include "traction/subscriber.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace traction::view {

/// A message on the wire: topic, a zero byte, bytes. Shared by the sessions that send it.
using Frame = std::shared_ptr<const std::string>;

/// Copies topic and bytes into a frame.
Frame makeFrame(std::string_view topic, std::string_view bytes);

/// Kinds of frames, beside Topics; or-ed.
enum Kinds : unsigned {
  kErrors = 256,     ///< the topic is "error", the bytes are a code of docs/clients.md, a blank and a sentence
  kPlaces = 512,     ///< "view/places": where the nodes are in the picture, float32 u, v [px]
  kSurface = 1024,   ///< "view/surface": the sequence of a field as uint64, Surface::share() and x, y, z of node after
                     ///< node [mm], float32
  kTime = 2048,      ///< "view/time": the position of a recording that is played, JSON
  kRecorder = 4096,  ///< "view/recorder": the recording that is being made, JSON
  kPicture = 8192,   ///< "view/picture": where it lies in the camera's picture, JSON, a zero byte, a preview as JPEG
  kHealth = 16384,   ///< "view/health": how well a live sensor measures, and what is wrong, JSON
  /// All but kPreview and kPicture, for which the daemon would make previews.
  kAllKinds = kAllTopics | kErrors | kPlaces | kSurface | kTime | kRecorder | kHealth,
};
inline constexpr unsigned kKindCount = 15;

/// Returns the kind of a published message: its one bit of Topics.
inline unsigned kindOf(const Message& message) {
  return 1U << message.index();  // Topics has the order of Message
}

/// Returns a frame with the error's code, as clients in other languages name it (docs/clients.md), and sentence.
/// \param id of the question that it answers; empty: of none
Frame errorFrame(const Error& error, const std::string& id = "");

/// Called on the thread of the part that delivers.
/// \param kind one bit of Topics or Kinds
using Deliver = std::function<void(unsigned kind, const Frame& frame)>;

}  // namespace traction::view

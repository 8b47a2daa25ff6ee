#include "client/viewer/forwarder.h"

#include "client/viewer/places.h"

#include <cstring>
#include <utility>

namespace traction::view {

void Forwarder::pass(const Message& message, const Raw& raw) {
  deliver_(kindOf(message), makeFrame(raw.topic, raw.bytes));
  if (const auto* field = std::get_if<Field>(&message); field != nullptr && wantsSurface_) passSurface(*field);
  if (const auto* description = std::get_if<Description>(&message)) passPlaces(*description);
}

void Forwarder::passSurface(const Field& field) {
  if (const auto description = std::exchange(description_, std::nullopt)) surface_.describe(*description);
  const auto* moved_mm = surface_.displacement(field);
  if (moved_mm == nullptr) return;
  const auto count = static_cast<std::size_t>(moved_mm->size());
  std::string bytes(sizeof(field.header.sequence) + count * sizeof(float), '\0');
  std::memcpy(bytes.data(), &field.header.sequence, sizeof(field.header.sequence));
  std::memcpy(&bytes[sizeof(field.header.sequence)], moved_mm->data(), count * sizeof(float));
  deliver_(kSurface, makeFrame("view/surface", bytes));
}

void Forwarder::passPlaces(const Description& description) {
  description_ = description;
  const std::vector<float> places = nodePlaces_px(description);
  std::string bytes(places.size() * sizeof(float), '\0');
  if (!places.empty()) std::memcpy(bytes.data(), places.data(), bytes.size());
  deliver_(kPlaces, makeFrame("view/places", bytes));
}

}  // namespace traction::view

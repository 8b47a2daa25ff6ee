#include "client/viewer/forwarder.h"

#include "client/viewer/jpeg.h"
#include "client/viewer/places.h"

#include <array>
#include <cstdio>
#include <cstring>
#include <utility>

namespace traction::view {

void Forwarder::pass(const Message& message, const Raw& raw) {
  const unsigned kind = kindOf(message);
  if (raw.topic.empty() && kind == kContacts) return;  // the library's own ends of contacts
  if (kind != kPreview || wants(kPreview)) deliver_(kind, makeFrame(raw.topic, raw.bytes));
  if (const auto* field = std::get_if<Field>(&message); field != nullptr && wants(kSurface)) passSurface(*field);
  if (const auto* description = std::get_if<Description>(&message)) passPlaces(*description);
  if (const auto* preview = std::get_if<Preview>(&message); preview != nullptr && wants(kPicture))
    passPicture(*preview);
}

void Forwarder::passSurface(const Field& field) {
  if (const auto description = std::exchange(description_, std::nullopt)) surface_.describe(*description);
  const auto* moved_mm = surface_.displacement(field);
  if (moved_mm == nullptr) return;
  const auto count = static_cast<std::size_t>(moved_mm->size());
  const float share = surface_.share();
  std::string bytes;
  const auto append = [&bytes](const void* from, std::size_t size) {
    bytes.append(static_cast<const char*>(from), size);
  };
  append(&field.header.sequence, sizeof(field.header.sequence));
  append(&share, sizeof(share));
  append(moved_mm->data(), count * sizeof(float));
  deliver_(kSurface, makeFrame("view/surface", bytes));
}

void Forwarder::passPlaces(const Description& description) {
  description_ = description;
  const std::vector<float> places = nodePlaces_px(description);
  std::string bytes(places.size() * sizeof(float), '\0');
  if (!places.empty()) std::memcpy(bytes.data(), places.data(), bytes.size());
  deliver_(kPlaces, makeFrame("view/places", bytes));
}

void Forwarder::passPicture(const Preview& preview) {
  const std::string jpeg = jpegOf(preview.pixels, preview.width, preview.height, preview.channels);
  if (jpeg.empty()) return;
  std::array<char, 200> place{};
  std::snprintf(place.data(), place.size(),
                R"({"frame_number":%llu,"width":%u,"height":%u,"scale":%.9g,"origin_px":[%.9g,%.9g]})",
                static_cast<unsigned long long>(preview.header.frameNumber), preview.width, preview.height,
                preview.scale, preview.origin_px[0], preview.origin_px[1]);
  std::string bytes = place.data();
  bytes.append(1, '\0').append(jpeg);
  deliver_(kPicture, makeFrame("view/picture", bytes));
}

}  // namespace traction::view

#include "client/src/decode.h"

#include "client/src/fields.h"
#include "traction/v1/preview.pb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <type_traits>
#include <utility>

namespace traction {

namespace {

/// Returns whether a number, or each number in nested ranges, is finite; true for everything else.
template <typename Member>
bool isFinite(const Member& member) {
  if constexpr (std::is_floating_point_v<Member>) {
    return std::isfinite(member);
  } else if constexpr (requires { requires std::is_floating_point_v<typename Member::value_type>; }) {
    typename Member::value_type sum = 0;  // becomes NaN by one that is not finite; faster than looking at each
    for (const auto number : member) sum += 0 * number;
    return sum == 0;
  } else if constexpr (requires { member.begin(); }) {
    return std::all_of(member.begin(), member.end(), [](const auto& each) { return isFinite(each); });
  } else if constexpr (requires { member.member; }) {
    return isFinite(member.member);
  } else {
    return true;
  }
}

bool isThisHost(const std::string& host) {
  std::string text;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), text);
  text.erase(std::remove(text.begin(), text.end(), '-'), text.end());
  std::string digits;
  for (const unsigned char byte : host) {
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789abcdef"[byte & 15];
  }
  return !text.empty() && text == digits;
}

// Take a value of the protocol, of the kinds that fields() has. \throws Error kMalformed

template <typename Own, typename Wire>
void take(Own& to, const Wire& from);

void take(Id& to, const std::string& from) {
  require(from.empty() || from.size() == to.size(), "an id has not 16 bytes");
  std::copy(from.begin(), from.end(), to.begin());
}

void take(std::vector<std::uint8_t>& to, const std::string& from) {
  to.assign(from.begin(), from.end());
}

void take(bool& isSame, const std::string& host) {
  isSame = isThisHost(host);
}

void take(Vector2& to, const pb::Vector2& from) {
  to = {from.x(), from.y()};
}

void take(Vector3& to, const pb::Vector3& from) {
  to = {from.x(), from.y(), from.z()};
}

/// Leaves 0 if the daemon does not report the matrix.
void take(Matrix3& to, const google::protobuf::RepeatedField<double>& from) {
  require(from.empty() || from.size() == static_cast<int>(to.size()), "a covariance is not 3 x 3");
  std::copy(from.begin(), from.end(), to.begin());
}

void take(std::vector<float>& to, const google::protobuf::RepeatedField<float>& from) {
  to.assign(from.begin(), from.end());
}

/// Splits x y z x y z ... into vectors of kSize.
template <std::size_t kSize>
void take(std::vector<std::array<float, kSize>>& to, const google::protobuf::RepeatedField<float>& from) {
  require(from.size() % kSize == 0, "a vector is incomplete");
  to.resize(static_cast<std::size_t>(from.size()) / kSize);
  if (!to.empty()) std::memcpy(to.data(), from.data(), to.size() * sizeof to[0]);
}

template <typename Own, typename Wire>
void take(std::vector<Own>& to, const google::protobuf::RepeatedPtrField<Wire>& from) {
  to.resize(static_cast<std::size_t>(from.size()));
  for (std::size_t i = 0; i < to.size(); ++i) take(to[i], from[static_cast<int>(i)]);
}

template <typename Own, typename Wire>
void take(std::optional<Own>& to, const Wire* from) {
  if (from != nullptr) take(to.emplace(), *from);
}

// What JSON prints otherwise.
template <typename Own, typename Wire>
void take(Given<Own>& to, const Wire& from) {
  take(to.member, from);
}
void take(Flags<std::uint32_t>& to, std::uint32_t from) {
  to.member = from;
}
void take(Contrast<bool>& to, bool from) {
  to.member = from;
}

// What must hold besides. \throws Error kMalformed
void check(auto&) {}

void check(Field& field) {
  require(field.nodeValid.size() == field.force_N.size(), "the field's mask has another size");
  require(field.nodeDeviation_N.empty() || field.nodeDeviation_N.size() == field.force_N.size(),
          "the field's deviations have another size");
}

void check(Markers& markers) {
  require(markers.valid.size() == markers.displacement_px.size() &&
              markers.variance_px2.size() == markers.displacement_px.size(),
          "the markers' arrays have different sizes");
}

void check(Camera& camera) {
  if (camera.aspect == 0.0) camera.aspect = 1.0;  // older daemons support square pixels only
}

void check(Zero& zero) {
  require(zero.markerPresent.size() == zero.restPosition_px.size(), "the rest pose's mask has another size");
}

void check(Body& body) {
  const std::size_t nodes = body.nodePositions_m.size();
  require(body.nodeNormals.size() == nodes && body.nodeAreas_m2.size() == nodes, "the body's nodes have other sizes");
}

/// Takes all fields of a message. Throws kMalformed unless its numbers are finite, because machines are controlled by
/// them; those of a header and a solver may be anything.
template <typename Own, typename Wire>
void takeFields(Own& to, const Wire& from) {
  fields(to, from, [](const char*, auto&& member, const auto& value) {
    take(member, value);
    if constexpr (!std::is_same_v<Own, Header> && !std::is_same_v<Own, Solver>)
      require(isFinite(member), "a number is not finite");
  });
  check(to);
}

template <typename Own, typename Wire>
void take(Own& to, const Wire& from) {
  if constexpr (std::is_base_of_v<google::protobuf::MessageLite, Wire>) {
    takeFields(to, from);
  } else if constexpr (std::is_enum_v<Own>) {
    to = enumOf(from, std::get<WireEnum<Own>>(kEnums).last);
  } else {
    to = from;
  }
}

/// Decodes a message whose header and fields() are all that it has.
template <typename Own, typename Wire>
Own decoded(const Wire& from) {
  Own message;
  takeFields(message.header, from.header());
  takeFields(message, from);
  return message;
}

Preview previewOf(const pb::Preview& from) {
  Preview preview;
  takeFields(preview.header, from.header());
  preview.width = from.width();
  preview.height = from.height();
  preview.channels = from.format() == pb::PREVIEW_FORMAT_MONO8 ? 1 : 3;
  require(from.format() == pb::PREVIEW_FORMAT_MONO8 || from.format() == pb::PREVIEW_FORMAT_RGB8,
          "the preview's format is unknown");
  // Compares one factor after another: the product of all three may exceed 64 bits.
  const std::size_t row = std::size_t{preview.width} * preview.channels;
  require(row == 0 || preview.height == 0
              ? from.pixels().empty()
              : from.pixels().size() % row == 0 && from.pixels().size() / row == preview.height,
          "the preview has more or fewer pixels than its size says");
  preview.pixels.assign(from.pixels().begin(), from.pixels().end());
  preview.scale = from.scale();
  take(preview.origin_px, from.origin_px());
  require(isFinite(preview.scale) && isFinite(preview.origin_px), "a number is not finite");
  return preview;
}

}  // namespace

Zero zeroOf(const pb::Zero& from) {
  Zero zero;
  takeFields(zero, from);
  return zero;
}

Description descriptionOf(const pb::Description& from) {
  return decoded<Description>(from);
}

Status statusOf(pb::Status from) {
  const pb::Latencies& latencies = from.latencies();
  for (const pb::Quantiles* each : {&latencies.track(), &latencies.solve(), &latencies.send(), &latencies.total()}) {
    const pb::Histogram& all = each->since_start();
    require(all.count().empty() || all.count_size() == all.bound_s_size() + 1,
            "a histogram has no count for each bound");
  }
  Status status;
  takeFields(status.header, from.header());
  status.message = std::make_shared<const pb::Status>(std::move(from));
  return status;
}

Message decode(unsigned topic, std::string_view bytes) {
  switch (topic) {
  case kMarkers:
    return decoded<Markers>(parse<pb::Markers>(bytes));
  case kDescription:
    return descriptionOf(parse<pb::Description>(bytes));
  case kStatus:
    return statusOf(parse<pb::Status>(bytes));
  case kPreview:
    return previewOf(parse<pb::Preview>(bytes));
  case kContacts:
    return decoded<Contacts>(parse<pb::Contacts>(bytes));
  case kGrasp:
    return decoded<Grasp>(parse<pb::Grasp>(bytes));
  default:
    return decoded<Field>(parse<pb::Field>(bytes));
  }
}

}  // namespace traction

#include "daemon/publish/wire_camera.h"

#include "traction/v1/control.pb.h"

#include <algorithm>
#include <cmath>

namespace tractiond::publish {

namespace pb = traction::v1;

namespace {

constexpr std::size_t kLongestName = 128;
constexpr std::size_t kLongestValue = 1024;
constexpr int kMostCategories = 64;

static_assert(pb::CameraFeatureKind_MAX == static_cast<int>(CameraFeature::Kind::kRegister));
static_assert(pb::CameraFeatureAccess_MAX == static_cast<int>(CameraFeature::Access::kReadWrite));

bool isWord(std::string_view text) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
  return !text.empty() && text.find_first_not_of(kAllowed) == std::string_view::npos;
}

/// GenICam's names, with a selector's entry in brackets perhaps.
bool isName(std::string_view text) {
  const std::size_t bracket = text.find('[');
  if (bracket == std::string_view::npos) return text.size() <= kLongestName && isWord(text);
  return text.size() <= kLongestName && text.back() == ']' && isWord(text.substr(0, bracket)) &&
         isWord(text.substr(bracket + 1, text.size() - bracket - 2));
}

tl::expected<CameraStep, std::string> named(CameraStep::Kind kind, const std::string& name) {
  if (isName(name)) return CameraStep{.kind = kind, .name = name};
  return tl::unexpected<std::string>(
      "that is no name of a camera's feature: letters, digits and _, as in ExposureTime or BalanceRatio[Red]");
}

bool isPlain(std::string_view text, std::size_t longest) {
  const auto isControl = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  return text.size() <= longest && std::ranges::none_of(text, isControl);
}

/// Of the UTF-8 character at the beginning; 0: there is none. The ranges of the Unicode standard, table 3-7.
std::size_t characterLength(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto follows = [&](std::size_t i, unsigned from = 0x80, unsigned to = 0xbf) {
    return byte(i) >= from && byte(i) <= to;
  };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead >= 0xc2 && lead <= 0xdf) return follows(1) ? 2 : 0;
  if (lead >= 0xe0 && lead <= 0xef) {
    return follows(1, lead == 0xe0 ? 0xa0 : 0x80, lead == 0xed ? 0x9f : 0xbf) && follows(2) ? 3 : 0;
  }
  if (lead < 0xf0 || lead > 0xf4) return 0;
  return follows(1, lead == 0xf0 ? 0x90 : 0x80, lead == 0xf4 ? 0x8f : 0xbf) && follows(2) && follows(3) ? 4 : 0;
}

/// A camera's registers hold anything; readers refuse a message with text that is none.
std::string text(std::string_view bytes) {
  std::string result;
  while (!bytes.empty()) {
    const std::size_t length = characterLength(bytes);
    result += length == 0 ? "?" : bytes.substr(0, length);
    bytes.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return result;
}

void encode(const CameraFeature& from, pb::CameraFeature& to) {
  to.set_name(text(from.name));
  to.set_value(text(from.value));
  to.set_unit(text(from.unit));
  to.set_kind(static_cast<pb::CameraFeatureKind>(from.kind));
  to.set_access(static_cast<pb::CameraFeatureAccess>(from.access));
  const auto isTold = [](const std::optional<double>& number) { return number && std::isfinite(*number); };
  if (isTold(from.minimum)) to.set_minimum(*from.minimum);
  if (isTold(from.maximum)) to.set_maximum(*from.maximum);
  if (isTold(from.increment)) to.set_increment(*from.increment);
  for (const std::string& entry : from.entries) to.add_entries(text(entry));
  to.set_description(text(from.description));
  to.set_configured(text(from.configured));
  to.set_first(text(from.first));
  to.set_category(text(from.category));
  for (const std::string& choice : from.selected) to.add_selected(text(choice));
}

}  // namespace

tl::expected<CameraStep, std::string> decodeCameraStep(const pb::CameraRequest& request) {
  using Step = CameraStep::Kind;
  switch (request.step_case()) {
  case pb::CameraRequest::kList: {
    const pb::CameraList& list = request.list();
    const auto& categories = list.categories();
    const bool isShort = categories.size() <= kMostCategories && isPlain(list.matching(), kLongestName) &&
                         std::ranges::all_of(categories, [](const auto& one) { return isPlain(one, kLongestName); });
    if (!isShort)
      return tl::unexpected<std::string>("the features to be listed are not described in a few plain words");
    return CameraStep{
        .kind = Step::kList, .matching = list.matching(), .categories = {categories.begin(), categories.end()}};
  }
  case pb::CameraRequest::kRead:
    return named(Step::kRead, request.read().name());
  case pb::CameraRequest::kWrite: {
    if (!isPlain(request.write().value(), kLongestValue)) {
      return tl::unexpected<std::string>("the value for a feature is to be one line of at most 1024 characters");
    }
    auto step = named(Step::kWrite, request.write().name());
    if (step) step->value = request.write().value();
    return step;
  }
  case pb::CameraRequest::kExecute:
    return named(Step::kExecute, request.execute().name());
  case pb::CameraRequest::kBalanceWhite:
    return CameraStep{.kind = Step::kBalanceWhite};
  case pb::CameraRequest::kTrigger:
    return CameraStep{.kind = Step::kTrigger};
  case pb::CameraRequest::STEP_NOT_SET:
    break;
  }
  return tl::unexpected<std::string>("this request about the camera is unknown to this version of tractiond");
}

void encode(const CameraReport& from, pb::CameraReply& to) {
  for (const CameraFeature& feature : from.features) encode(feature, *to.add_features());
  for (const std::string& remark : from.remarks) to.add_remarks(text(remark));
  to.set_camera(text(from.camera));
}

}  // namespace tractiond::publish

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

void encode(const CameraFeature& from, pb::CameraFeature& to) {
  to.set_name(from.name);
  to.set_value(from.value);
  to.set_unit(from.unit);
  to.set_kind(static_cast<pb::CameraFeatureKind>(from.kind));
  to.set_access(static_cast<pb::CameraFeatureAccess>(from.access));
  const auto isTold = [](const std::optional<double>& number) { return number && std::isfinite(*number); };
  if (isTold(from.minimum)) to.set_minimum(*from.minimum);
  if (isTold(from.maximum)) to.set_maximum(*from.maximum);
  if (isTold(from.increment)) to.set_increment(*from.increment);
  for (const std::string& entry : from.entries) to.add_entries(entry);
  to.set_description(from.description);
  to.set_configured(from.configured);
  to.set_first(from.first);
  to.set_category(from.category);
  for (const std::string& choice : from.selected) to.add_selected(choice);
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
  for (const std::string& remark : from.remarks) to.add_remarks(remark);
  to.set_camera(from.camera);
}

}  // namespace tractiond::publish

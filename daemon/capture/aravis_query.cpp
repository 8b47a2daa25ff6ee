// What people ask of a camera while it streams: its features, as text.
#include "base/spelling.h"
#include "daemon/capture/aravis.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <map>
#include <set>

namespace tractiond::capture {
namespace {

using Answer = tl::expected<CameraReport, std::string>;

std::string lower(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  return word;
}

CameraFeature::Kind kindOf(ArvGcNode* node) {
  if (ARV_IS_GC_COMMAND(node)) return CameraFeature::Kind::kCommand;
  if (ARV_IS_GC_BOOLEAN(node)) return CameraFeature::Kind::kBoolean;
  if (ARV_IS_GC_ENUMERATION(node)) return CameraFeature::Kind::kEnumeration;
  if (ARV_IS_GC_INTEGER(node)) return CameraFeature::Kind::kInteger;
  if (ARV_IS_GC_FLOAT(node)) return CameraFeature::Kind::kFloat;
  if (ARV_IS_GC_STRING(node)) return CameraFeature::Kind::kString;
  if (ARV_IS_GC_REGISTER_NODE(node)) return CameraFeature::Kind::kRegister;
  return CameraFeature::Kind::kUnknown;
}

CameraFeature::Access accessOf(ArvGcNode* node) {
  auto* feature = ARV_GC_FEATURE_NODE(node);
  const bool locked = arv_gc_feature_node_is_locked(feature, nullptr) != FALSE;
  switch (arv_gc_feature_node_get_actual_access_mode(feature)) {
  case ARV_GC_ACCESS_MODE_RO:
    return CameraFeature::Access::kRead;
  case ARV_GC_ACCESS_MODE_WO:
    return locked ? CameraFeature::Access::kNone : CameraFeature::Access::kWrite;
  case ARV_GC_ACCESS_MODE_RW:
    return locked ? CameraFeature::Access::kRead : CameraFeature::Access::kReadWrite;
  default:
    return CameraFeature::Access::kNone;
  }
}

/// "BalanceRatio[Red]": a feature and the choice of its selector.
struct Selected {
  std::string feature, choice;
};
Selected parsed(const std::string& name) {
  const auto open = name.find('[');
  if (open == std::string::npos || name.back() != ']') return {name, ""};
  return {name.substr(0, open), name.substr(open + 1, name.size() - open - 2)};
}

/// Whether a feature decides which part of the sensor's picture is sent, and how.
bool isOfThePicture(const std::string& feature) {
  for (const char* one : {"Width", "Height", "OffsetX", "OffsetY", "PixelFormat", "Binning", "Decimation", "Reverse"})
    if (feature.find(one) == 0) return true;
  return false;
}

class Query {
 public:
  Query(ArvCamera* camera, const std::vector<Feature>& configured, std::map<std::string, std::string>& first)
      : camera_(camera)
      , device_(arv_camera_get_device(camera))
      , configured_(configured)
      , first_(first) {
    report_.camera = text(arv_camera_get_vendor_name(camera, nullptr)) + "-" +
                     text(arv_camera_get_device_serial_number(camera, nullptr));
    collect("Root", "");
  }

  Answer list(const CameraStep& step) {
    const std::string wanted = lower(step.matching);
    for (const Place& place : places_) {
      if (!wanted.empty() && lower(place.name).find(wanted) == std::string::npos) continue;
      const bool within =
          step.categories.empty() ||
          std::any_of(step.categories.begin(), step.categories.end(), [&](const std::string& category) {
            return ("/" + lower(place.category) + "/").find("/" + lower(category) + "/") != std::string::npos;
          });
      if (!within) continue;
      const auto leaf = place.category.substr(place.category.rfind('/') + 1);
      report_.features.push_back(describe(place.name, leaf));
    }
    if (report_.features.empty()) return tl::unexpected<std::string>("the camera has no feature that matches");
    return report_;
  }

  Answer read(const std::string& name) {
    return with(name, [&](const std::string& feature) -> Answer {
      report_.features.push_back(describe(feature));
      return report_;
    });
  }

  Answer write(const std::string& name, const std::string& value) {
    return with(name, [&](const std::string& feature) -> Answer {
      if (isOfThePicture(feature))
        return tl::unexpected(feature + " changes the picture that markers are followed in: set it in [camera] of the "
                                        "configuration, restart tractiond, and take a new zero");
      if (ARV_IS_GC_COMMAND(arv_device_get_feature(device_, feature.c_str())))
        return tl::unexpected(feature + " is a command: execute it");
      const std::string before = readFeature(device_, feature);
      const auto written = writeFeature(device_, {feature, value});
      if (!written) return tl::unexpected(written.error().message());
      first_.emplace(feature, before);
      report_.features.push_back(describe(feature));
      return report_;
    });
  }

  Answer execute(const std::string& name) {
    return with(name, [&](const std::string& feature) -> Answer {
      if (!ARV_IS_GC_COMMAND(arv_device_get_feature(device_, feature.c_str())))
        return tl::unexpected(feature + " is not a command: set it");
      const auto done = writeFeature(device_, {feature, true});
      if (!done) return tl::unexpected(done.error().message());
      report_.remarks.push_back(*done);
      return report_;
    });
  }

  Answer balanceWhite() {
    if (!hasFeature(device_, "BalanceWhiteAuto"))
      return tl::unexpected<std::string>("the camera cannot balance white by itself: it has no BalanceWhiteAuto; see "
                                         "tractionctl camera list balance");
    const auto done = writeFeature(device_, {"BalanceWhiteAuto", std::string("Once")});
    if (!done) return tl::unexpected(done.error().message());
    for (int i = 0; i < 100 && readFeature(device_, "BalanceWhiteAuto") == "Once"; ++i) g_usleep(50'000);
    if (readFeature(device_, "BalanceWhiteAuto") == "Once")
      return tl::unexpected<std::string>("the camera has not balanced white within 5 s: are frames flowing?");
    for (const char* choice : {"Red", "Green", "Blue"}) {
      if (const Answer gain = read(std::string("BalanceRatio[") + choice + "]"); !gain)
        report_.remarks.push_back(gain.error());
    }
    return report_;
  }

  Answer trigger() {
    Failure failure;
    if (readFeature(device_, "TriggerMode") == "Off")
      return tl::unexpected<std::string>("the camera waits for no trigger (TriggerMode is Off); set camera.trigger = "
                                         "\"software\"");
    const std::string source = readFeature(device_, "TriggerSource");
    if (source != "Software")
      return tl::unexpected("the camera's trigger is " + (source.empty() ? std::string("not to be had") : source) +
                            ", not Software; set camera.trigger = \"software\"");
    arv_camera_software_trigger(camera_, failure.into());
    if (failure) return tl::unexpected("the camera does not take the trigger: " + failure.text());
    return report_;
  }

 private:
  struct Place {
    std::string name, category;
  };

  /// Descriptions may go in circles.
  void collect(const std::string& category, const std::string& path) {
    if (!visited_.insert(category).second) return;
    ArvGcNode* node = arv_device_get_feature(device_, category.c_str());
    if (node == nullptr || !ARV_IS_GC_CATEGORY(node)) return;
    for (const GSList* one = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); one != nullptr; one = one->next) {
      const std::string name = text(static_cast<const char*>(one->data));
      ArvGcNode* child = arv_device_get_feature(device_, name.c_str());
      if (child == nullptr) continue;
      if (ARV_IS_GC_CATEGORY(child))
        collect(name, path.empty() ? name : path + "/" + name);
      else if (ARV_IS_GC_FEATURE_NODE(child))
        places_.push_back({name, path});
    }
  }

  std::vector<std::string> selectorsOf(ArvGcNode* node) const {
    std::vector<std::string> selectors;
    if (!ARV_IS_GC_SELECTOR(node)) return selectors;
    // A selector lists what it selects; the other way round is asked for here.
    const std::string name = text(arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node)));
    for (const Place& place : places_) {
      ArvGcNode* other = arv_device_get_feature(device_, place.name.c_str());
      if (other == nullptr || !ARV_IS_GC_SELECTOR(other)) continue;
      for (const GSList* s = arv_gc_selector_get_selected_features(ARV_GC_SELECTOR(other)); s != nullptr; s = s->next) {
        auto* selected = static_cast<ArvGcFeatureNode*>(s->data);
        if (name == text(arv_gc_feature_node_get_name(selected))) selectors.push_back(place.name);
      }
    }
    return selectors;
  }

  void limits(ArvGcNode* node, CameraFeature& feature) const {
    const char* name = feature.name.c_str();
    Failure failure;
    if (feature.kind == CameraFeature::Kind::kInteger) {
      gint64 low = 0, high = 0;
      arv_device_get_integer_feature_bounds(device_, name, &low, &high, failure.into());
      if (!failure) feature.minimum = static_cast<double>(low), feature.maximum = static_cast<double>(high);
      const gint64 step = arv_device_get_integer_feature_increment(device_, name, failure.into());
      if (!failure && step > 1) feature.increment = static_cast<double>(step);
      feature.unit = text(arv_gc_integer_get_unit(ARV_GC_INTEGER(node)));
    } else if (feature.kind == CameraFeature::Kind::kFloat) {
      double low = 0, high = 0;
      arv_device_get_float_feature_bounds(device_, name, &low, &high, failure.into());
      if (!failure && low > -1e300) feature.minimum = low;
      if (!failure && high < 1e300) feature.maximum = high;
      feature.unit = text(arv_gc_float_get_unit(ARV_GC_FLOAT(node)));
    } else if (feature.kind == CameraFeature::Kind::kEnumeration) {
      feature.entries = offeredEntries(device_, name);
    }
  }

  CameraFeature describe(const std::string& name, const std::string& category = {}) {
    CameraFeature feature{.name = name, .category = category};
    ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
    if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) return feature;
    auto* gc = ARV_GC_FEATURE_NODE(node);
    feature.kind = kindOf(node);
    feature.description = text(arv_gc_feature_node_get_tooltip(gc));
    if (feature.description.empty()) feature.description = text(arv_gc_feature_node_get_description(gc));
    Failure failure;
    if (!arv_gc_feature_node_is_available(gc, failure.into())) return feature;
    feature.access = accessOf(node);
    if (feature.access != CameraFeature::Access::kWrite) feature.value = readFeature(device_, name);
    limits(node, feature);
    for (const std::string& selector : selectorsOf(node))
      feature.selected.push_back(selector + "=" + readFeature(device_, selector));
    for (const Feature& one : configured_)
      if (one.name == name) feature.configured = textOf(one);
    if (const auto before = first_.find(name); before != first_.end()) feature.first = before->second;
    return feature;
  }

  /// Sets the selector for as long as `work` runs.
  Answer with(const std::string& name, const std::function<Answer(const std::string&)>& work) {
    const Selected wanted = parsed(name);
    ArvGcNode* node = arv_device_get_feature(device_, wanted.feature.c_str());
    if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) {
      // Names that contain the word, or that differ from it by few letters.
      const std::string word = lower(wanted.feature);
      const std::size_t few = std::max<std::size_t>(1, word.size() / 5);
      std::string close;
      for (const Place& place : places_) {
        const std::string known = lower(place.name);
        if (known.find(word) == std::string::npos && misspellings(known, word) > few) continue;
        close += (close.empty() ? "" : ", ") + place.name;
      }
      return tl::unexpected("the camera has no feature " + wanted.feature + (close.empty() ? "" : "; it has " + close));
    }
    if (wanted.choice.empty()) return work(wanted.feature);
    const std::vector<std::string> selectors = selectorsOf(node);
    for (const std::string& selector : selectors) {
      const std::string stood = readFeature(device_, selector);
      if (!writeFeature(device_, {selector, wanted.choice})) continue;
      Answer answer = work(wanted.feature);
      std::ignore = writeFeature(device_, {selector, stood});
      return answer;
    }
    return tl::unexpected(wanted.feature + " has no choice " + wanted.choice +
                          (selectors.empty() ? ": nothing selects it" : " of " + joined(selectors)));
  }

  ArvCamera* camera_;
  ArvDevice* device_;
  const std::vector<Feature>& configured_;
  std::map<std::string, std::string>& first_;
  std::vector<Place> places_;
  std::set<std::string> visited_;
  CameraReport report_;
};

}  // namespace

tl::expected<CameraReport, std::string> serveFeatures(ArvCamera* camera, const CameraStep& step,
                                                      const std::vector<Feature>& configured,
                                                      std::map<std::string, std::string>& first) {
  Query query(camera, configured, first);
  switch (step.kind) {
  case CameraStep::Kind::kList:
    return query.list(step);
  case CameraStep::Kind::kRead:
    return query.read(step.name);
  case CameraStep::Kind::kWrite:
    return query.write(step.name, step.value);
  case CameraStep::Kind::kExecute:
    return query.execute(step.name);
  case CameraStep::Kind::kBalanceWhite:
    return query.balanceWhite();
  case CameraStep::Kind::kTrigger:
    return query.trigger();
  }
  return tl::unexpected<std::string>("this cannot be asked");
}

}  // namespace tractiond::capture

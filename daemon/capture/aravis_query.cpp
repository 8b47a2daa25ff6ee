// What people ask of a camera while it streams: its features, as text.
#include "base/spelling.h"
#include "daemon/capture/aravis.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <set>

namespace tractiond::capture {
namespace {

namespace pb = traction::v1;
using Answer = tl::expected<CameraReport, std::string>;

std::string lower(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  return word;
}

pb::CameraFeatureKind kindOf(ArvGcNode* node) {
  if (ARV_IS_GC_COMMAND(node)) return pb::CAMERA_FEATURE_KIND_COMMAND;
  if (ARV_IS_GC_BOOLEAN(node)) return pb::CAMERA_FEATURE_KIND_BOOLEAN;
  if (ARV_IS_GC_ENUMERATION(node)) return pb::CAMERA_FEATURE_KIND_ENUMERATION;
  if (ARV_IS_GC_INTEGER(node)) return pb::CAMERA_FEATURE_KIND_INTEGER;
  if (ARV_IS_GC_FLOAT(node)) return pb::CAMERA_FEATURE_KIND_FLOAT;
  if (ARV_IS_GC_STRING(node)) return pb::CAMERA_FEATURE_KIND_STRING;
  if (ARV_IS_GC_REGISTER_NODE(node)) return pb::CAMERA_FEATURE_KIND_REGISTER;
  return pb::CAMERA_FEATURE_KIND_UNKNOWN;
}

pb::CameraFeatureAccess accessOf(ArvGcNode* node) {
  auto* feature = ARV_GC_FEATURE_NODE(node);
  const bool locked = arv_gc_feature_node_is_locked(feature, nullptr) != FALSE;
  switch (arv_gc_feature_node_get_actual_access_mode(feature)) {
  case ARV_GC_ACCESS_MODE_RO:
    return pb::CAMERA_FEATURE_ACCESS_READ;
  case ARV_GC_ACCESS_MODE_WO:
    return locked ? pb::CAMERA_FEATURE_ACCESS_NONE : pb::CAMERA_FEATURE_ACCESS_WRITE;
  case ARV_GC_ACCESS_MODE_RW:
    return locked ? pb::CAMERA_FEATURE_ACCESS_READ : pb::CAMERA_FEATURE_ACCESS_READ_WRITE;
  default:
    return pb::CAMERA_FEATURE_ACCESS_NONE;
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
    report_.set_camera(text(arv_camera_get_vendor_name(camera, nullptr)) + "-" +
                       text(arv_camera_get_device_serial_number(camera, nullptr)));
    collect("Root", "");
  }

  Answer list(const pb::CameraList& step) {
    const std::string wanted = lower(step.matching());
    for (const Place& place : places_) {
      if (!wanted.empty() && lower(place.name).find(wanted) == std::string::npos) continue;
      const bool within =
          step.categories().empty() ||
          std::any_of(step.categories().begin(), step.categories().end(), [&](const std::string& category) {
            return ("/" + lower(place.category) + "/").find("/" + lower(category) + "/") != std::string::npos;
          });
      if (!within) continue;
      const auto leaf = place.category.substr(place.category.rfind('/') + 1);
      describe(place.name, leaf);
    }
    if (report_.features().empty()) return tl::unexpected<std::string>("the camera has no feature that matches");
    return report_;
  }

  Answer read(const std::string& name) {
    return with(name, [&](const std::string& feature) -> Answer {
      describe(feature);
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
      if (const bool isRounded = written->find(" (asked: ") != std::string::npos; isRounded) {
        report_.add_remarks("the camera rounds: " + *written);
        if (readFeature(device_, feature) == before)
          return tl::unexpected("nothing has changed: the camera still says " + *written +
                                "; it may round to steps, or refuse the value in its present state");
      }
      first_.emplace(feature, before);
      describe(feature);
      return report_;
    });
  }

  Answer execute(const std::string& name) {
    return with(name, [&](const std::string& feature) -> Answer {
      if (!ARV_IS_GC_COMMAND(arv_device_get_feature(device_, feature.c_str())))
        return tl::unexpected(feature + " is not a command: set it");
      const auto done = writeFeature(device_, {feature, true});
      if (!done) return tl::unexpected(done.error().message());
      report_.add_remarks(*done);
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
        report_.add_remarks(gain.error());
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
    const char* name = feature.name().c_str();
    Failure failure;
    if (feature.kind() == pb::CAMERA_FEATURE_KIND_INTEGER) {
      gint64 low = 0, high = 0;
      arv_device_get_integer_feature_bounds(device_, name, &low, &high, failure.into());
      if (!failure) {
        feature.set_minimum(static_cast<double>(low));
        feature.set_maximum(static_cast<double>(high));
      }
      const gint64 step = arv_device_get_integer_feature_increment(device_, name, failure.into());
      if (!failure && step > 1) feature.set_increment(static_cast<double>(step));
      feature.set_unit(text(arv_gc_integer_get_unit(ARV_GC_INTEGER(node))));
    } else if (feature.kind() == pb::CAMERA_FEATURE_KIND_FLOAT) {
      double low = 0, high = 0;
      arv_device_get_float_feature_bounds(device_, name, &low, &high, failure.into());
      if (!failure && std::abs(low) < 1e300) feature.set_minimum(low);
      if (!failure && std::abs(high) < 1e300) feature.set_maximum(high);
      feature.set_unit(text(arv_gc_float_get_unit(ARV_GC_FLOAT(node))));
    } else if (feature.kind() == pb::CAMERA_FEATURE_KIND_ENUMERATION) {
      for (const std::string& entry : offeredEntries(device_, name)) feature.add_entries(entry);
    }
  }

  /// Adds a feature to the report.
  void describe(const std::string& name, const std::string& category = {}) {
    CameraFeature& feature = *report_.add_features();
    feature.set_name(name);
    feature.set_category(category);
    ArvGcNode* node = arv_device_get_feature(device_, name.c_str());
    if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) return;
    auto* gc = ARV_GC_FEATURE_NODE(node);
    feature.set_kind(kindOf(node));
    feature.set_description(text(arv_gc_feature_node_get_tooltip(gc)));
    if (feature.description().empty()) feature.set_description(text(arv_gc_feature_node_get_description(gc)));
    Failure failure;
    if (!arv_gc_feature_node_is_available(gc, failure.into())) return;
    feature.set_access(accessOf(node));
    if (feature.access() != pb::CAMERA_FEATURE_ACCESS_WRITE) feature.set_value(readFeature(device_, name));
    limits(node, feature);
    for (const std::string& selector : selectorsOf(node))
      feature.add_selected(selector + "=" + readFeature(device_, selector));
    for (const Feature& one : configured_)
      if (one.name == name) feature.set_configured(textOf(one));
    if (const auto before = first_.find(name); before != first_.end()) feature.set_first(before->second);
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
  switch (step.step_case()) {
  case CameraStep::kList:
    return query.list(step.list());
  case CameraStep::kRead:
    return query.read(step.read().name());
  case CameraStep::kWrite:
    return query.write(step.write().name(), step.write().value());
  case CameraStep::kExecute:
    return query.execute(step.execute().name());
  case CameraStep::kBalanceWhite:
    return query.balanceWhite();
  case CameraStep::kTrigger:
    return query.trigger();
  case CameraStep::STEP_NOT_SET:
    break;
  }
  return tl::unexpected<std::string>("this cannot be asked");
}

}  // namespace tractiond::capture

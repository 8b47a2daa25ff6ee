#include "client/cli/health.h"

#include "client/src/printable.h"
#include "traction/v1/status.pb.h"

#include <algorithm>

namespace traction::cli {

bool isWithoutGel(const v1::Status& status) {
  return status.markers().layers().empty() && !status.markers().remark().empty();
}

std::string cameraSentence(const v1::Status& status) {
  const auto state = [&] {
    switch (status.camera()) {
    case v1::CAMERA_STATE_WAITING:
      return "waiting for its camera";
    case v1::CAMERA_STATE_STREAMING:
      return "camera open";
    case v1::CAMERA_STATE_LOST:
      return "camera lost, being looked for";
    case v1::CAMERA_STATE_CONNECTING:
      return "camera found, being set up";
    default:
      return "camera not opened yet";
    }
  }();
  return state + (status.camera_why().empty() ? std::string() : " (" + status.camera_why() + ")");
}

std::string whyNoField(const v1::Status& status) {
  if (status.camera() != v1::CAMERA_STATE_STREAMING) return cameraSentence(status);
  return isWithoutGel(status) ? status.markers().remark() : "";
}

std::string refusedOf(const v1::Status& status) {
  const v1::Scheduling& scheduling = status.scheduling();
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const auto any = [&](auto&& isRefused) {
    return std::any_of(scheduling.threads().begin(), scheduling.threads().end(), isRefused);
  };
  if (scheduling.asked_priority() > 0 && any([](const v1::ThreadScheduling& one) { return one.priority() == 0; }))
    add("priority " + std::to_string(scheduling.asked_priority()));
  if (!scheduling.asked_cpus().empty() &&
      any([&](const v1::ThreadScheduling& one) { return one.cpus() != scheduling.asked_cpus(); }))
    add("processors " + scheduling.asked_cpus());
  if (scheduling.asked_lock() && scheduling.locked_bytes() == 0) add("memory");
  return text;
}

std::string whyNoForces(const Scene& scene, std::int64_t now_ns) {
  const Scene::Trouble trouble = scene.trouble(now_ns);
  if (!trouble.what.empty()) return scene.sentence(trouble);
  if (scene.field->valid) return "";
  if (scene.status && !(*scene.status)->invalid_why().empty()) return printable((*scene.status)->invalid_why());
  return (scene.field->header.flags & kGelMismatch) != 0 ? "the gel file does not fit the picture"
                                                         : "too few markers are seen";
}

std::vector<std::string> warnings(const Scene& scene, std::int64_t now_ns) {
  constexpr std::int64_t kRestartIsNews_ns = 10'000'000'000;
  std::vector<std::string> texts;
  if (scene.restarted_ns != 0 && now_ns - scene.restarted_ns < kRestartIsNews_ns)
    texts.push_back("tractiond restarted");
  if (!scene.field || !scene.trouble(now_ns).what.empty()) return texts;
  for (const std::string& one : words(scene.field->header.flags)) texts.push_back(one);
  return texts;
}

std::vector<std::string> problems(const Scene& scene, std::int64_t now_ns) {
  std::vector<std::string> all;
  const auto add = [&](const std::string& what) { all.push_back(printable(what)); };
  const Scene::Trouble trouble = scene.trouble(now_ns);
  if (!trouble.what.empty()) {
    add(scene.sentence(trouble));
  } else {
    if (!scene.field->valid) {
      const bool isKnown = scene.status && !(*scene.status)->invalid_why().empty();
      add("no valid forces" + (isKnown ? ": " + (*scene.status)->invalid_why() : ""));
    }
    for (const std::string& flag : words(scene.recentFlags(now_ns))) add(flag);
  }
  if (!scene.status) return all;
  const std::string& remark = (*scene.status)->markers().remark();
  if (!remark.empty() && remark != trouble.what) add(remark);
  if (const std::string refused = refusedOf(*scene.status->message); !refused.empty())
    add("real time is not granted: " + refused);
  return all;
}

}  // namespace traction::cli

#include "client/show/health.h"

#include "base/printable.h"
#include "traction/v1/status.pb.h"

#include <algorithm>
#include <array>
#include <utility>

namespace traction::client {

namespace {

void add(std::vector<Problem>& all, Health health, const std::string& what) {
  all.push_back({health, printable(what)});
}

/// Adds the problems that only a status reports.
/// \param reported problem that has been added already
void addDoubts(const v1::Status& status, const std::string& reported, std::vector<Problem>& all) {
  const std::string& remark = status.markers().remark();
  if (!remark.empty() && remark != reported) add(all, Health::kDoubtful, remark);
  if (const std::string refused = refusedOf(status); !refused.empty())
    add(all, Health::kDoubtful, "real time is not granted: " + refused);
}

/// Returns why the newest field has no valid forces.
std::string whyInvalid(const Scene& scene) {
  if (scene.status && !(*scene.status)->invalid_why().empty()) return (*scene.status)->invalid_why();
  const unsigned flags = scene.field->header.flags;
  return (flags & kGelMismatch) != 0 ? "the gel file does not fit the picture"
         : (flags & kNotSolved) != 0 ? "not solved in time"
                                     : "too few markers are seen";
}

}  // namespace

const char* nameOf(Health health) {
  constexpr std::array kNames = {"measuring", "doubtful", "no_forces", "no_fields"};
  return kNames.at(static_cast<std::size_t>(health));
}

std::string sentence(const Problem& problem) {
  return (problem.health == Health::kNoForces ? "no valid forces: " : "") + problem.what;
}

Health healthOf(const std::vector<Problem>& problems) {
  Health worst = Health::kMeasuring;
  for (const Problem& one : problems) worst = std::max(worst, one.health);
  return worst;
}

std::vector<Problem> problems(const v1::Status& status) {
  std::vector<Problem> all;
  const std::string why = whyNoField(status);
  const std::string silent = whyNoPicture(status);
  const bool publishes = status.rates().published_hz() > 0.0;
  if (!silent.empty() && silent != why && (why.empty() || !status.camera_why().empty()))
    add(all, publishes && status.rates().received_hz() > 0.0 ? Health::kDoubtful : Health::kNoFields, silent);
  if (!why.empty()) {
    add(all, Health::kNoFields, why);
  } else if (silent.empty() && !publishes) {
    add(all, Health::kNoFields, "no field is made of the frames");
  }
  if (!status.invalid_why().empty()) add(all, Health::kNoForces, status.invalid_why());
  addDoubts(status, why, all);
  return all;
}

std::vector<Problem> problems(const Scene& scene, std::int64_t now_ns) {
  constexpr std::int64_t kRestartIsNews_ns = 10'000'000'000;
  std::vector<Problem> all;
  const Scene::Trouble trouble = scene.trouble(now_ns);
  if (!trouble.what.empty()) {
    add(all, Health::kNoFields, scene.sentence(trouble));
  } else if (!scene.field->valid) {
    add(all, Health::kNoForces, whyInvalid(scene));
  }
  if (scene.restarted_ns != 0 && now_ns - scene.restarted_ns < kRestartIsNews_ns)
    add(all, Health::kDoubtful, "tractiond restarted");
  if (trouble.what.empty()) {
    for (const FlagText& flag : kFlagTexts) {
      if ((scene.recentFlags(now_ns) & flag.flag) == 0 || (!all.empty() && all.front().what == flag.words)) continue;
      add(all, flag.flag == kZeroUnverified || flag.flag == kGelUnverified ? Health::kMeasuring : Health::kDoubtful,
          flag.words);
    }
  }
  if (scene.status) addDoubts(*scene.status->message, trouble.what, all);
  return all;
}

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
  if (status.rates().received_hz() > 0.0 && status.rates().published_hz() == 0.0 && !status.camera_why().empty())
    return whyNoPicture(status);
  return isWithoutGel(status) ? status.markers().remark() : "";
}

std::string whyNoPicture(const v1::Status& status) {
  const bool sends = status.rates().received_hz() > 0.0;
  if (status.camera() != v1::CAMERA_STATE_STREAMING || (sends && status.camera_why().empty())) return "";
  return (sends ? "the camera sends nothing new" : "the camera sends no frames") +
         (status.camera_why().empty() ? std::string() : ": " + status.camera_why());
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

}  // namespace traction::client

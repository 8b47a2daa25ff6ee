#include "daemon/app/reload.h"

#include "daemon/app/gel_files.h"
#include "daemon/solve/make_solver.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace tractiond {
tl::expected<Reread, Error> reread(Config completed) {
  const auto gel = loadGel(completed.sensor.gelFile);
  if (!gel) return tl::unexpected(gel.error());
  const Id calibration = *gel ? solve::calibrationId(**gel, completed.solve) : Id{};
  return Reread{std::move(completed), calibration};
}

tl::expected<News, Error> apply(const Reread& read, Config& inForce, const Id& calibration, bool hasCameraRefused) {
  const bool piped = !inForce.camera.images.empty();
  News news;
  std::vector<std::string> bound;
  for (const Change& change : changesBetween(inForce, read.config)) {
    const bool camera = change.key.starts_with("camera.");
    news.isOfCamera = news.isOfCamera || camera;
    if (change.live && !(camera && piped))
      news.lines.push_back(fmt::format("{} = {} (was {})", change.key, change.after.empty() ? "none" : change.after,
                                       change.before.empty() ? "none" : change.before));
    else
      bound.push_back(change.key);
  }
  if (bound.empty() && read.calibration != calibration) bound.emplace_back("what sensor.gel_file holds");
  if (!bound.empty()) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = fmt::format("not while it runs: {}", fmt::join(bound, ", ")),
                                .remedy = "restart the service"});
  }
  if (!news.isOfCamera && hasCameraRefused) {
    news.isOfCamera = true;
    news.lines.emplace_back("what the camera refused, once more");
  }
  inForce.logLevel = read.config.logLevel;
  spdlog::set_level(spdlog::level::from_str(inForce.logLevel));
  if (news.isOfCamera) inForce.camera = read.config.camera;
  return news;
}

bool takeOver(const tl::expected<Reread, Error>& read, Config& inForce, const Id& calibration, bool hasCameraRefused) {
  const auto news =
      read.and_then([&](const Reread& one) { return apply(one, inForce, calibration, hasCameraRefused); });
  if (!news) {
    spdlog::error("the configuration stays as it was: {}", news.error().message());
    return false;
  }
  if (news->lines.empty()) spdlog::info("nothing in the configuration has changed");
  for (const std::string& line : news->lines) spdlog::info("new in the configuration: {}", line);
  return news->isOfCamera;
}

}  // namespace tractiond

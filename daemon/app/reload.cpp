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

tl::expected<std::vector<std::string>, Error> Reloader::apply(const Reread& read) {
  const bool piped = !inForce_.camera.images.empty();
  std::vector<std::string> news, bound;
  bool ofCamera = false;
  for (const Change& change : changesBetween(inForce_, read.config)) {
    const bool camera = change.key.starts_with("camera.");
    ofCamera = ofCamera || camera;
    if (change.live && !(camera && piped))
      news.push_back(fmt::format("{} = {} (was {})", change.key, change.after.empty() ? "none" : change.after,
                                 change.before.empty() ? "none" : change.before));
    else
      bound.push_back(change.key);
  }
  if (bound.empty() && read.calibration != calibration_) bound.emplace_back("what sensor.gel_file holds");
  if (!bound.empty()) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = fmt::format("not while it runs: {}", fmt::join(bound, ", ")),
                                .remedy = "restart the service"});
  }
  if (!ofCamera && camera_.hasRefused()) {
    ofCamera = true;
    news.emplace_back("what the camera refused, once more");
  }
  inForce_.logLevel = read.config.logLevel;
  spdlog::set_level(spdlog::level::from_str(inForce_.logLevel));
  if (ofCamera) {
    inForce_.camera = read.config.camera;
    camera_.reopen();
  }
  return news;
}

void Reloader::takeOver(const tl::expected<Reread, Error>& read) {
  const auto news = read.and_then([this](const Reread& one) { return apply(one); });
  if (!news)
    spdlog::error("the configuration stays as it was: {}", news.error().message());
  else if (news->empty())
    spdlog::info("nothing in the configuration has changed");
  else
    for (const std::string& one : *news) spdlog::info("new in the configuration: {}", one);
}

}  // namespace tractiond

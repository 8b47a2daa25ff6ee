#include "tests/simulation/operator.h"

#include "daemon/app/config.h"
#include "daemon/app/instance.h"
#include "tests/simulation/gel.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr const char *kFile = "/etc/tractiond.toml", *kGelFile = "/etc/gel.toml";

}  // namespace

Operator::Operator(Disk& disk, Journal& journal)
    : disk_(disk)
    , journal_(journal) {
  write({});
}

void Operator::write(const File& file) {
  file_ = file;
  disk_.put(kFile,
            fmt::format("[sensor]\ngel_file = \"gel.toml\"\n[camera]\ngain = {}\n{}[publish]\n"
                        "high_water_mark = {}\n[log]\nlevel = \"{}\"\n{}",
                        file.gain, file.isRefused ? "features = [{ NoSuchFeature = 1 }]\n" : "", file.isBound ? 7 : 256,
                        file.isDebug ? "debug" : "info", file.isMistaken ? "nonsense = 1\n" : ""));
  disk_.put(kGelFile, fmt::format("format = 1\n[gel]\npoisson_ratio = {}\n", file.isOfOtherGel ? 0.45 : 0.48));
}

void Operator::edit(Edit how) {
  if (how == Edit::kNothing) return;
  File next{.gain = file_.gain, .isDebug = file_.isDebug};
  if (how != Edit::kLevel && how != Edit::kRefused) next.gain = ++newest_;
  if (how != Edit::kGain && how != Edit::kRefused) next.isDebug = !next.isDebug;
  next.isRefused = how == Edit::kRefused;
  next.isBound = how == Edit::kBound;
  next.isMistaken = how == Edit::kMistake;
  next.isOfOtherGel = how == Edit::kGel;
  write(next);
}

tl::expected<Reread, Error> Operator::load() const {
  auto config = loadConfig(kFile);
  if (!config) return tl::unexpected(config.error());
  return reread(completed(*std::move(config), {.instance = "simulation", .state = kState, .runtime = "/run"}));
}

Reread Operator::start() {
  if (!file_.canBeTaken() || file_.isRefused) write({.gain = file_.gain, .isDebug = file_.isDebug});
  taken_ = file_;
  isCameraRefusing_ = false;
  gains_ = {file_.gain};
  auto loaded = load();
  journal_.law(loaded.has_value(), "a daemon starts with a right configuration",
               loaded ? "" : loaded.error().message());
  spdlog::set_level(spdlog::level::from_str(loaded->config.logLevel));
  return *std::move(loaded);
}

tl::expected<Reread, Error> Operator::read() {
  if (file_.canBeTaken()) {
    const bool isOfCamera = file_.gain != taken_.gain || file_.isRefused != taken_.isRefused;
    if (isOfCamera || isCameraRefusing_) isCameraRefusing_ = file_.isRefused;
    if (isOfCamera && !file_.isRefused) gains_.push_back(file_.gain);
    taken_ = file_;
  }
  auto loaded = load();
  readUntil_ns_ = disk_.workUntil_ns();
  return loaded;
}

void Operator::check(const capture::CameraOptions& opened) {
  const int gain = static_cast<int>(opened.gain.value_or(0.0));
  const bool isDebug = spdlog::get_level() == spdlog::level::debug;
  const bool isRight = isCameraRefusing_ ? std::ranges::find(gains_, gain) != gains_.end() : gain == taken_.gain;
  journal_.law(isRight && opened.features.empty() && isDebug == taken_.isDebug,
               "a reload takes all of a configuration or nothing",
               fmt::format("gain {}, not {}; debug {}, not {}", gain, taken_.gain, isDebug, taken_.isDebug));
  gains_ = {gain};
}

}  // namespace tractiond::simulation

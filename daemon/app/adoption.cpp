#include "daemon/app/adoption.h"

#include "base/clock.h"
#include "base/whole_file.h"
#include "daemon/app/gel_files.h"
#include "daemon/track/rest_pose_file.h"

#include <chrono>
#include <fstream>
#include <utility>

namespace tractiond {
namespace {

namespace fs = std::filesystem;

fs::path besides(const fs::path& adopted, const char* suffix) {
  return adopted.string() + suffix;
}

fs::path startsOf(const fs::path& adopted) {
  return besides(adopted, ".starts");
}

/// Puts a file that was checked in the place of the one in force. Whenever the power is lost, one of both is in force.
std::error_code putInForce(const fs::path& candidate, const fs::path& path) {
  std::error_code error;
  const auto before = readWholeFile(path);
  if (!before) {
    fs::remove(earlierGel(path), error);  // somebody has taken away what was in force, and means it
  } else if (!isOnTrial(path)) {
    error = replaceWholeFile(earlierGel(path), *before);
  }
  if (error) return error;
  if (error = replaceWholeFile(startsOf(path), std::span<const char>()); error) return error;
  fs::rename(candidate, path, error);
  return error ? error : synchroniseNames(path.parent_path());
}

tl::expected<void, std::string> keep(const fs::path& path, const std::string& gelFile,
                                     const capture::CameraInfo& camera, const std::string& program) {
  const fs::path candidate = besides(path, ".candidate");
  const auto unwritten = [&path](const std::error_code& error) {
    return tl::unexpected(path.string() + " cannot be written: " + error.message());
  };
  if (const std::error_code error = replaceWholeFile(candidate, gelFile)) return unwritten(error);
  std::error_code ignored;
  auto sensor = checkInChild(candidate, program).and_then([&] { return readAdopted(gelFile, camera); });
  if (!sensor) {
    fs::remove(candidate, ignored);
    return tl::unexpected(sensor.error().message());
  }
  if (const std::error_code error = putInForce(candidate, path)) return unwritten(error);
  for (const auto& zero : {track::restPosePath(path.parent_path()), track::earlierPosePath(path.parent_path())}) {
    if (!track::loadRestPose(zero, *sensor, camera.format, measuredWith(camera).text())) fs::remove(zero, ignored);
  }
  return {};
}

}  // namespace

void Adoption::begin(const fs::path& path, std::string gelFile, const capture::CameraInfo& camera) {
  writer_.emplace("tr-adopt");
  written_ = writer_->start([path, gelFile = std::move(gelFile), camera, program = program_] {
    return keep(path, gelFile, camera, program);
  });
}

std::optional<tl::expected<void, std::string>> Adoption::turn() {
  if (!writer_ || !writer_->awaitIdle(std::chrono::milliseconds(0))) return std::nullopt;
  writer_.reset();
  auto outcome = written_.get();
  if (outcome) kept_ns_ = monotonicNow();
  return outcome;
}

bool Adoption::isDue() const {
  constexpr std::int64_t kAnswer_ns = 300'000'000;
  const std::int64_t kept_ns = kept_ns_;
  return kept_ns != 0 && monotonicNow() - kept_ns > kAnswer_ns;
}

fs::path earlierGel(const fs::path& adopted) {
  return besides(adopted, ".earlier");
}

bool isOnTrial(const fs::path& adopted) {
  std::error_code absent;
  return !adopted.empty() && fs::exists(adopted, absent) && fs::exists(startsOf(adopted), absent);
}

std::string countStart(const fs::path& adopted) {
  constexpr std::uintmax_t kMost = 2;
  if (!isOnTrial(adopted)) return {};
  std::error_code ignored;
  if (fs::file_size(startsOf(adopted), ignored) < kMost) {
    std::ofstream(startsOf(adopted), std::ios::app | std::ios::binary) << '.';
    return {};
  }
  const fs::path aside = besides(adopted, ".refused");
  fs::rename(adopted, aside, ignored);
  const bool hasEarlier = fs::exists(earlierGel(adopted), ignored);
  if (hasEarlier) fs::rename(earlierGel(adopted), adopted, ignored);
  fs::remove(startsOf(adopted), ignored);
  return "the gel file that was adopted did not run in two starts; it is put aside as " + aside.string() +
         (hasEarlier ? ", and the one before is in force again" : ", and there is none before it");
}

void forgetStart(const fs::path& adopted) {
  std::error_code ignored;
  if (!isOnTrial(adopted)) return;
  const std::uintmax_t starts = fs::file_size(startsOf(adopted), ignored);
  if (!ignored && starts > 0) fs::resize_file(startsOf(adopted), starts - 1, ignored);
}

void endTrial(const fs::path& adopted) {
  std::error_code ignored;
  if (isOnTrial(adopted)) fs::remove(startsOf(adopted), ignored);
}

}  // namespace tractiond

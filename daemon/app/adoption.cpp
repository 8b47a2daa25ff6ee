#include "daemon/app/adoption.h"

#include "base/clock.h"
#include "base/whole_file.h"
#include "daemon/track/rest_pose_file.h"

#include <chrono>
#include <utility>

namespace tractiond {

void Adoption::begin(const std::filesystem::path& path, Adopted adopted) {
  writer_.emplace("tr-adopt");
  written_ = writer_->start([path, adopted = std::move(adopted)]() -> tl::expected<void, std::string> {
    if (const std::error_code error = replaceWholeFile(path, adopted.gelFile))
      return tl::unexpected(path.string() + " cannot be written: " + error.message());
    for (const auto& zero : {track::restPosePath(path.parent_path()), track::earlierPosePath(path.parent_path())}) {
      std::error_code ignored;
      if (!track::loadRestPose(zero, adopted.sensor, adopted.format, adopted.camera))
        std::filesystem::remove(zero, ignored);
    }
    return {};
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

}  // namespace tractiond

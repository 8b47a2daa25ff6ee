#include "daemon/control/zero_store.h"

#include "base/whole_file.h"

namespace tractiond::control {

tl::expected<void, Error> saveZeros(const std::filesystem::path& stateDirectory, const RestPose& zero,
                                    const RestPose* before, const ZeroOwner& owner) {
  const auto save = [&owner](const std::filesystem::path& path, const RestPose& one) {
    return track::saveRestPose(path, one, owner.sensor, owner.format, owner.camera);
  };
  if (before != nullptr) {
    if (auto saved = save(track::earlierPosePath(stateDirectory), *before); !saved) return saved;
  }
  return save(track::restPosePath(stateDirectory), zero);
}

tl::expected<std::optional<RestPose>, Error> restoreZero(const std::filesystem::path& stateDirectory,
                                                         const ZeroOwner& owner) {
  auto zero = track::loadRestPose(track::restPosePath(stateDirectory), owner.sensor, owner.format, owner.camera);
  if (zero && *zero) static_cast<void>(synchroniseNames(stateDirectory));
  return zero;
}

tl::expected<std::optional<RestPose>, Error> loadEarlierZero(const std::filesystem::path& stateDirectory,
                                                             const std::optional<RestPose>& restored,
                                                             const ZeroOwner& owner) {
  auto earlier = track::loadRestPose(track::earlierPosePath(stateDirectory), owner.sensor, owner.format, owner.camera);
  if (earlier && *earlier && restored && (*earlier)->id == restored->id) return std::nullopt;
  return earlier;
}

}  // namespace tractiond::control

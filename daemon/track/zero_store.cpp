#include "daemon/track/zero_store.h"

namespace tractiond::track {

tl::expected<void, Error> saveZeros(const std::filesystem::path& stateDirectory, const RestPose& zero,
                                    const RestPose* before, const ZeroOwner& owner) {
  const auto save = [&owner](const std::filesystem::path& path, const RestPose& one) {
    return saveRestPose(path, one, owner.sensor, owner.format, owner.camera);
  };
  if (before != nullptr) {
    if (auto saved = save(earlierPosePath(stateDirectory), *before); !saved) return saved;
  }
  return save(restPosePath(stateDirectory), zero);
}

tl::expected<std::optional<RestPose>, Error> loadEarlierZero(const std::filesystem::path& stateDirectory,
                                                             const std::optional<RestPose>& restored,
                                                             const ZeroOwner& owner) {
  auto earlier = loadRestPose(earlierPosePath(stateDirectory), owner.sensor, owner.format, owner.camera);
  if (earlier && *earlier && restored && (*earlier)->id == restored->id) return std::nullopt;
  return earlier;
}

}  // namespace tractiond::track

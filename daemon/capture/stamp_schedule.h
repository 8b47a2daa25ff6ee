// When a camera that takes pictures at an even pace is due to stamp its next one. Another host that sends a picture
// before the camera does can hide that by an earlier stamp; the stamp then comes before the schedule.
#pragma once

#include <cstdint>

namespace tractiond::capture {

/// Follows the earliest stamps, as an operating system stamps late and never early. Thread-bound. Allocates nothing.
class StampSchedule {
 public:
  /// Adds the next frame's stamp [ns]; the first call does the same as restart(). \param step increase of its id since
  /// the frame before, at least 1
  void add(std::int64_t device_ns, std::int64_t step);
  /// Sets pace() back to what it was before the last add(), which was told too small a step.
  void keepPace(std::int64_t pace_ns) { pace_ns_ = pace_ns; }
  /// Forgets the frames so far and begins with one whose stamp is `device_ns`: after the camera's clock has jumped.
  void restart(std::int64_t device_ns);

  /// Returns whether recent stamps came at an even pace: on average within 1/32 of it. False for fewer than two frames.
  /// Those of a triggered camera do not.
  bool isEven() const { return frames_ > 1 && kTimes * uneven_ns_ <= quarter(); }
  /// Returns whether a next stamp [ns] is so much earlier than the schedule that it is hardly the camera's. False where
  /// stamps are not isEven(), and after a gap of more than four ids. \param step as in add()
  bool isEarly(std::int64_t device_ns, std::int64_t step) const;
  /// Returns the mean time between two stamps [ns]; 0: not known yet.
  std::int64_t pace() const { return pace_ns_; }
  /// Returns a quarter of that.
  std::int64_t quarter() const { return pace_ns_ / 4; }

 private:
  static constexpr std::int64_t kTimes = 8;  ///< a camera's stamp differs by so many mean differences at most
  std::int64_t ahead(std::int64_t device_ns, std::int64_t step) const;

  std::int64_t due_ns_ = 0;     ///< time of the newest frame by the schedule
  std::int64_t last_ns_ = 0;    ///< the newest stamp
  std::int64_t pace_ns_ = 0;    ///< mean time between two frames
  std::int64_t uneven_ns_ = 0;  ///< mean difference of the stamps from the schedule
  int frames_ = 0;              ///< since the restart, up to a sufficient number
};

}  // namespace tractiond::capture

#include "daemon/app/no_gel.h"

#include "traction/v1/status.pb.h"

#include <string>

namespace tractiond {
namespace {

constexpr const char* kRemedy = "; name a gel file in sensor.gel_file and restart the service";

}  // namespace

const std::string_view NoGel::kWhy = "no gel: nothing is measured; set sensor.gel_file";

void NoGel::measure(traction::v1::Status& status) {
  status.mutable_markers()->mutable_remark()->assign(kWhy);
}

bool NoGel::track(const Frame& frame, MarkerField& /*markers*/) {
  if (Snapshot* const wanted = snapshots_.lent()) {
    wanted->copyFrom(frame);
    snapshots_.giveBack();
  }
  return false;
}

void NoGel::beginZero(const ZeroRequest& /*request*/) {
  replies_.answerZero(tl::unexpected(std::string("there is no gel, so there is no zero") + kRemedy));
}

void NoGel::beginStep(const CalibrationStep& /*step*/) {
  replies_.answerCalibration(
      tl::unexpected(std::string("there is no gel, so there is nothing to calibrate") + kRemedy));
}

void NoGel::turn() {
  snapshots_.take();
  snapshots_.turn();
}

}  // namespace tractiond

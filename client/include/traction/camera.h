// Reads and changes the camera's GenICam features while the camera streams.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace traction {

/// Request for the camera: looks at features or changes one. A change lasts until the camera is opened again; a
/// permanent setting belongs in the daemon's configuration.
struct CameraStep {
  enum class Kind {
    kList,          ///< reports the features that match
    kRead,          ///< reports one feature
    kWrite,         ///< writes one feature and reports its value after the write
    kExecute,       ///< executes one command, waits until the camera reports it done, and reports the features that it
                    ///< changed
    kBalanceWhite,  ///< balances white once on the current picture and reports the gains
    kTrigger,       ///< sends one software trigger
  };
  Kind kind = Kind::kList;
  std::string name;      ///< for kRead, kWrite, kExecute: "ExposureTime", "BalanceRatio[Red]"
  std::string value;     ///< for kWrite: a number with a decimal point, true or false, or the name of an entry
  std::string matching;  ///< for kList: part of a feature's name, case-insensitive; empty: all
  std::vector<std::string> categories;  ///< for kList: features in or below one of these; empty: all
};

/// One feature as the camera reports it.
struct CameraFeature {
  enum class Kind { kUnknown, kInteger, kFloat, kBoolean, kEnumeration, kString, kCommand, kRegister };
  enum class Access { kNone, kRead, kWrite, kReadWrite };

  std::string name;   ///< name that the camera gives it
  std::string value;  ///< written as in CameraStep; empty: there is none, or it cannot be read
  std::string unit;   ///< unit that the camera gives it: "us"
  Kind kind = Kind::kUnknown;
  /// Access at this moment: a feature that is locked during streaming is not writable then.
  Access access = Access::kNone;
  /// Limits of a number, in `unit`; empty: the camera does not report them.
  std::optional<double> minimum, maximum, increment;
  std::vector<std::string> entries;   ///< of an enumeration: the entries that are available now
  std::string description;            ///< text of the camera
  std::string configured;             ///< value that the daemon's configuration sets; empty: it sets none
  std::string first;                  ///< value before the first write of this session; empty: not written
  std::string category;               ///< "AcquisitionControl"
  std::vector<std::string> selected;  ///< selector settings under which the value holds: "BalanceRatioSelector=Red"
};

/// Answer to a CameraStep.
struct CameraReport {
  std::vector<CameraFeature> features;  ///< that the step reports, in the order of the daemon; may be empty
  std::vector<std::string> remarks;     ///< for a person to read
  std::string camera;                   ///< the camera that answered: "Vendor-Serial"
};

}  // namespace traction

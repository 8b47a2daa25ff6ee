// The camera's features (GenICam's), looked at and changed while it runs.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace traction {

/// A look at the camera's features or a change of them. A change lasts until the camera is opened again: what is to
/// stay belongs into the daemon's configuration.
struct CameraStep {
  enum class Kind {
    kList,          ///< the features that match
    kRead,          ///< one feature
    kWrite,         ///< one feature; tells how it reads then
    kExecute,       ///< a command, until the camera says that it is done; tells what it changed
    kBalanceWhite,  ///< once, of what is seen now; tells the gains
    kTrigger,       ///< one software trigger
  };
  Kind kind = Kind::kList;
  std::string name;                     ///< read, write, execute: "ExposureTime", "BalanceRatio[Red]"
  std::string value;                    ///< write; a number with a point, true or false, an entry's name
  std::string matching;                 ///< list: part of a name, in capitals or not; empty: all
  std::vector<std::string> categories;  ///< list: in or below one of them; none: all
};

struct CameraFeature {
  enum class Kind { kUnknown, kInteger, kFloat, kBoolean, kEnumeration, kString, kCommand, kRegister };
  enum class Access { kNone, kRead, kWrite, kReadWrite };

  std::string name;   ///< as the camera calls it
  std::string value;  ///< as in CameraStep; empty: none, or it cannot be read
  std::string unit;   ///< as the camera says: "us"
  Kind kind = Kind::kUnknown;
  Access access = Access::kNone;                      ///< now: what is locked while pictures stream cannot be written
  std::optional<double> minimum, maximum, increment;  ///< of a number, in the unit; empty: the camera does not tell
  std::vector<std::string> entries;                   ///< of an enumeration, those available now
  std::string description;                            ///< the camera's own words
  std::string configured;                             ///< by the daemon's configuration; empty: it leaves it open
  std::string first;                  ///< before the first write of this session; empty: it was not written
  std::string category;               ///< "AcquisitionControl"
  std::vector<std::string> selected;  ///< of which choice the value is: "BalanceRatioSelector=Red"
};

struct CameraReport {
  std::vector<CameraFeature> features;
  std::vector<std::string> remarks;  ///< for people
  std::string camera;                ///< which it is: "Vendor-Serial"
};

}  // namespace traction

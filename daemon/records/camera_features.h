// What is asked of a camera's features while it runs, and what it tells. Values are text, as GenICam writes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {

struct CameraStep {
  enum class Kind : std::uint8_t {
    kList,          ///< the features that match
    kRead,          ///< one feature
    kWrite,         ///< one feature; tells how it reads then
    kExecute,       ///< a command, to its end; tells what it changed
    kBalanceWhite,  ///< once; tells the gains
    kTrigger,       ///< one software trigger
  };
  Kind kind = Kind::kList;
  std::string name = {};                     ///< read, write, execute: "ExposureTime", "BalanceRatio[Red]"
  std::string value = {};                    ///< write
  std::string matching = {};                 ///< list: part of a name, in capitals or not; empty: all
  std::vector<std::string> categories = {};  ///< list: in or below one of them; none: all
};

struct CameraFeature {
  enum class Kind : std::uint8_t {
    kUnknown,
    kInteger,
    kFloat,
    kBoolean,
    kEnumeration,
    kString,
    kCommand,
    kRegister,
  };
  enum class Access : std::uint8_t { kNone, kRead, kWrite, kReadWrite };

  std::string name = {};
  std::string value = {};  ///< a number with a point, true or false, an entry's name; empty: none, or it cannot be read
  std::string unit = {};   ///< as the camera says
  Kind kind = Kind::kUnknown;
  Access access = Access::kNone;  ///< now: what is locked while pictures stream cannot be written
  std::optional<double> minimum = {}, maximum = {}, increment = {};  ///< of a number
  std::vector<std::string> entries = {};                             ///< of an enumeration, those available now
  std::string description = {};                                      ///< the camera's own words
  std::string configured = {};             ///< what the configuration set it to; empty: it leaves it open
  std::string first = {};                  ///< before the first write of this session; empty: it was not written
  std::string category = {};               ///< "AcquisitionControl"
  std::vector<std::string> selected = {};  ///< of which choice the value is: "BalanceRatioSelector=Red"
};

struct CameraReport {
  std::vector<CameraFeature> features = {};
  std::vector<std::string> remarks = {};  ///< for people
  std::string camera = {};                ///< which it is: "Vendor-Serial"
};

}  // namespace tractiond

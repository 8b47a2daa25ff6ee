// Requests about a camera's features while it streams, and its answers. Values are text, as GenICam writes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {

struct CameraStep {
  enum class Kind : std::uint8_t {
    kList,          ///< reports the features that match
    kRead,          ///< reports one feature
    kWrite,         ///< writes one feature and reports its value after that
    kExecute,       ///< executes a command, and waits until it is done
    kBalanceWhite,  ///< balances white once and reports the gains
    kTrigger,       ///< sends one software trigger
  };
  Kind kind = Kind::kList;
  std::string name = {};                     ///< kRead, kWrite, kExecute: "ExposureTime", "BalanceRatio[Red]"
  std::string value = {};                    ///< kWrite: a number with a point, true or false, an entry's name, or text
  std::string matching = {};                 ///< kList: part of a name, case-insensitive; empty: all
  std::vector<std::string> categories = {};  ///< kList: features in or below one of these; empty: all
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
  std::string unit = {};   ///< as the camera reports it
  Kind kind = Kind::kUnknown;
  Access access = Access::kNone;  ///< at this moment: a feature that is locked during streaming cannot be written
  std::optional<double> minimum = {}, maximum = {}, increment = {};  ///< of a number
  std::vector<std::string> entries = {};                             ///< of an enumeration, those available now
  std::string description = {};                                      ///< the camera's own words
  std::string configured = {};             ///< value that the configuration sets; empty: it sets none
  std::string first = {};                  ///< value before the first write of this session; empty: not written
  std::string category = {};               ///< "AcquisitionControl"
  std::vector<std::string> selected = {};  ///< selectors under which the value holds: "BalanceRatioSelector=Red"
};

struct CameraReport {
  std::vector<CameraFeature> features = {};
  std::vector<std::string> remarks = {};  ///< sentences for the operator
  std::string camera = {};                ///< the camera that answered: "Vendor-Serial"
};

}  // namespace tractiond

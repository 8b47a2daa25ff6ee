// The page's files, compressed, as the build has bundled them.
#pragma once

#include <string_view>

namespace traction::view {

struct PageFile {
  std::string_view path;  ///< "/", "/app.js"
  std::string_view type;  ///< of its content
  std::string_view gzip;  ///< its content
};

/// Returns the file of the path of a URL, without its query; nullptr if there is none. The files live as long as the
/// program. Thread-safe.
const PageFile* findPageFile(std::string_view path);

}  // namespace traction::view

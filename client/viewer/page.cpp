#include "client/viewer/page.h"

#include <algorithm>
#include <array>

namespace traction::view {
namespace {

constexpr char kIndex[] = {
#include "index.html.gz.inc"
};
constexpr char kScript[] = {
#include "app.js.gz.inc"
};
constexpr char kStyle[] = {
#include "app.css.gz.inc"
};
constexpr char kIcon[] = {
#include "icon.svg.gz.inc"
};

constexpr std::array<PageFile, 4> kFiles = {{
    {"/", "text/html; charset=utf-8", {kIndex, sizeof(kIndex)}},
    {"/app.js", "text/javascript; charset=utf-8", {kScript, sizeof(kScript)}},
    {"/app.css", "text/css; charset=utf-8", {kStyle, sizeof(kStyle)}},
    {"/icon.svg", "image/svg+xml", {kIcon, sizeof(kIcon)}},
}};

}  // namespace

const PageFile* findPageFile(std::string_view path) {
  const auto* found =
      std::find_if(kFiles.begin(), kFiles.end(), [&](const PageFile& file) { return file.path == path; });
  return found == kFiles.end() ? nullptr : found;
}

}  // namespace traction::view

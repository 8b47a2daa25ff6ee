#include "base/whole_file.h"
#include "lens/commands.h"
#include "lens/sheet.h"

#include <cstdio>
#include <filesystem>

namespace lens {

Done writeSheets(const SheetsOptions& options) {
  const auto sensor = loadGel(options.gel);
  if (!sensor) return tl::unexpected(sensor.error());
  const std::filesystem::path folder = options.directory.empty() ? "." : options.directory;
  std::error_code made;  // a failure shows when the first file cannot be written
  std::filesystem::create_directories(folder, made);
  for (std::size_t i = 0; i < sensor->layers.size(); ++i) {
    const std::string path = folder / ("layer" + std::to_string(i + 1) + ".svg");
    if (const std::error_code failed = tractiond::replaceWholeFile(path, sheet(*sensor, i, {options.mirrored}))) {
      return tl::unexpected(Faults{
          tractiond::Error{.exitCode = EX_CANTCREAT, .what = "cannot be written: " + failed.message(), .where = path}});
    }
    std::printf("Written: %s\n", path.c_str());
  }
  const Eigen::Vector2d page_mm = 1e3 * pageSize(*sensor);
  std::printf("Pages of %.6g x %.6g mm: print them without fitting them to the paper, and measure the ruler.\n",
              page_mm.x(), page_mm.y());
  return {};
}

}  // namespace lens

#include "base/toml_table.h"
#include "base/whole_file.h"
#include "lens/commands.h"
#include "lens/sheet.h"
#include "sensor/gel_file.h"

#include <filesystem>
#include <system_error>

namespace lens {

using tractiond::Error;

Error fault(const std::string& where, std::string what, std::string remedy) {
  return {.exitCode = EX_DATAERR, .what = std::move(what), .where = where, .remedy = std::move(remedy)};
}

tl::expected<sensor::Sensor, Faults> loadGel(const std::string& path) {
  if (path.empty()) return sensor::Sensor{};
  auto sensor = sensor::loadGel(path);
  if (sensor) return *std::move(sensor);
  const tractiond::FileError& error = sensor.error();
  const int code = error.unreadable ? EX_NOINPUT : error.isData ? EX_DATAERR : EX_CONFIG;
  return tl::unexpected(Faults{{.exitCode = code, .what = error.what, .where = error.where}});
}

bool statesOfCamera(const std::string& gel, std::string_view key) {
  auto root = tractiond::TomlTable::load(gel);
  const auto camera = root ? root->table("camera") : std::nullopt;
  return camera && camera->has(key);
}

Done checkOutput(const std::string& path, bool replace) {
  std::error_code ignored;
  if (replace || !std::filesystem::exists(path, ignored)) return {};
  return tl::unexpected(Faults{{.exitCode = EX_CANTCREAT,
                                .what = "exists already, and what was edited in it would be lost",
                                .where = path,
                                .remedy = "name another --output, or replace it with --force"}});
}

Done writeGel(const std::string& path, sensor::Sensor sensor, const std::string& remark, Report& report) {
  if (sensor.calibration) {
    sensor.calibration.reset();
    report.note("the gel file's calibration is left out: calibrate again with tractionctl calibrate");
  }
  const std::string text = "# " + remark + "\n" + sensor::gelText(sensor);
  if (const std::error_code failed = tractiond::replaceWholeFile(path, text)) {
    return tl::unexpected(
        Faults{{.exitCode = EX_CANTCREAT, .what = "cannot be written: " + failed.message(), .where = path}});
  }
  report.line("Written: %s", path.c_str());
  return {};
}

Done writeSheets(const SheetsOptions& options, Report& report) {
  const auto sensor = loadGel(options.gel);
  if (!sensor) return tl::unexpected(sensor.error());
  const std::filesystem::path folder = options.directory.empty() ? "." : options.directory;
  std::error_code made;  // a failure shows when the first file cannot be written
  std::filesystem::create_directories(folder, made);
  for (std::size_t i = 0; i < sensor->layers.size(); ++i) {
    const std::string path = folder / ("layer" + std::to_string(i + 1) + ".svg");
    if (const std::error_code failed = tractiond::replaceWholeFile(path, sheet(*sensor, i, options.mirrored))) {
      return tl::unexpected(Faults{
          tractiond::Error{.exitCode = EX_CANTCREAT, .what = "cannot be written: " + failed.message(), .where = path}});
    }
    report.line("Written: %s", path.c_str());
  }
  const Eigen::Vector2d page_mm = 1e3 * pageSize(*sensor);
  report.note("pages of %.6g x %.6g mm: print them without fitting them to the paper, and measure the ruler",
              page_mm.x(), page_mm.y());
  return {};
}

}  // namespace lens

#include "daemon/app/gel_files.h"

#include "base/child.h"
#include "base/printable.h"
#include "base/whole_file.h"
#include "daemon/app/config.h"
#include "daemon/calibrate/calibration.h"
#include "daemon/capture/inspection.h"
#include "daemon/solve/make_solver.h"
#include "daemon/track/nominal.h"
#include "sensor/gel_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <system_error>
#include <utility>

namespace tractiond {
namespace {

/// Converts an error in a gel file, or in the influence file that it names.
Error gelError(const FileError& error, const std::string& gelFile) {
  Error result{.exitCode = EX_CONFIG, .what = error.what, .where = error.where};
  if (error.isData) {
    result.exitCode = EX_DATAERR;
    result.remedy = "write it again, as docs/influence-file.md says";
  } else if (error.unreadable) {
    result.exitCode = EX_NOINPUT;
    result.remedy = error.where == gelFile ? "sensor.gel_file names it" : "gel.influence_file names it";
  }
  return result;
}

constexpr const char* kForeign = "the gel file";

/// Reads a gel file from elsewhere: it must make the daemon read no other file, and not fill its memory.
tl::expected<sensor::Sensor, Error> readForeign(const std::string& text) {
  auto sensor = sensor::parseGelAlone(text, kForeign);
  if (!sensor) return tl::unexpected(gelError(sensor.error(), kForeign));
  if (auto same = calibrate::verifyCalibration(*sensor, kForeign); !same) return tl::unexpected(same.error());
  if (auto sound = track::trackable(*sensor); !sound) return tl::unexpected(sound.error());
  constexpr double kMost_bytes = 1.6 * (1 << 30);  // four fifths of MemoryMax= of the service
  if (const double needed_bytes = solve::neededMemory(*sensor); needed_bytes > kMost_bytes) {
    return tl::unexpected(
        Error{.exitCode = EX_CONFIG,
              .what = fmt::format("{} markers and {} nodes need some {:.1f} GiB, at most {:.1f} are possible",
                                  sensor->markerCount(), sensor->nodes.count(), needed_bytes / (1 << 30),
                                  kMost_bytes / (1 << 30)),
              .remedy = "measure fewer nodes"});
  }
  return *std::move(sensor);
}

}  // namespace

tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile) {
  if (gelFile == kNoGelFile) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = "sensor.gel_file is \"none\": without a gel there are no forces",
                                .remedy = "name a gel file"});
  }
  sensor::Sensor sensor;
  if (!gelFile.empty()) {
    auto loaded = sensor::loadGel(gelFile);
    if (!loaded) return tl::unexpected(gelError(loaded.error(), gelFile));
    sensor = *std::move(loaded);
    if (auto same = calibrate::verifyCalibration(sensor, gelFile); !same) return tl::unexpected(same.error());
  }
  if (auto sound = track::trackable(sensor); !sound) return tl::unexpected(sound.error());
  return sensor;
}

tl::expected<std::optional<sensor::Sensor>, Error> loadGel(const std::string& gelFile) {
  if (gelFile == kNoGelFile) return std::nullopt;
  return loadSensor(gelFile).map([](sensor::Sensor sensor) { return std::optional(std::move(sensor)); });
}

sensor::MeasuredWith measuredWith(const capture::CameraInfo& info) {
  return {.camera = sensor::cameraId(info.name.vendor, info.name.serial),
          .picture = fmt::format("{} x {} px{}", info.shape.width, info.shape.height, info.cut)};
}

tl::expected<void, Error> checkCamera(const sensor::Sensor& sensor, const capture::CameraInfo& info,
                                      const std::string& gelFile) {
  const sensor::Camera& expected = sensor.camera;
  if (info.shape.width != expected.width || info.shape.height != expected.height) {
    return tl::unexpected(Error{
        .exitCode = EX_CONFIG,
        .what = fmt::format("the camera's picture is {} x {} pixels, the gel's is {} x {}", info.shape.width,
                            info.shape.height, expected.width, expected.height),
        .remedy =
            "set camera.width_px and camera.height_px, or describe the gel's camera; to aim a camera before there is a "
            "gel file, set sensor.gel_file = \"none\""});
  }
  if (auto possible = track::trackable(sensor, info.format); !possible) return possible;
  // Files of before state the camera alone, and only if they are calibrated.
  const auto measured = sensor::MeasuredWith::parse(
      sensor.measuredWith.empty() && sensor.calibration ? sensor.calibration->camera : sensor.measuredWith);
  if (measured.holdsFor(measuredWith(info))) return {};
  return tl::unexpected(Error{
      .exitCode = EX_CONFIG,
      .what = fmt::format("the gel file's camera was measured with {}, this is {}", measured.text(),
                          measuredWith(info).text()),
      .where = gelFile,
      .remedy =
          info.name.serial.empty()
              ? "if these pictures are that camera's, delete camera.measured_with and "
                "the lines of calibration of the gel file"
              : "use that camera (camera.id) with that picture (camera.features), or measure lens and pose with this "
                "one: docs/calibration.md, another camera"});
}

tl::expected<sensor::Sensor, Error> readAdopted(const std::string& text, const capture::CameraInfo& info) {
  auto sensor = readForeign(text);
  if (!sensor) return sensor;
  if (auto fits = checkCamera(*sensor, info, kForeign); !fits) return tl::unexpected(fits.error());
  return sensor;
}

tl::expected<void, Error> checkInChild(const std::filesystem::path& gelFile, const std::string& program) {
  constexpr std::size_t kLongest = 500;
  const auto wrong = [](const std::string& what) { return tl::unexpected(Error{.exitCode = EX_CONFIG, .what = what}); };
  const ChildEnd end = runChild({"--inspect-gel", gelFile.string()}, {.program = program});
  if (const std::string what = capture::misdeed(end); !what.empty()) return wrong("the gel file " + what);
  if (end.code == EX_OK) return {};
  if (end.output.empty()) return wrong("the gel file makes what reads it end without a word");
  return wrong(traction::printable(end.output.substr(0, kLongest)));
}

int printGelCheck(const std::string& gelFile) {
  capture::limitChild();
  const auto bytes = readWholeFile(gelFile);
  if (!bytes) return EX_NOINPUT;
  const auto sensor = readForeign({bytes->begin(), bytes->end()});
  if (!sensor) std::cout << sensor.error().message() << std::flush;
  return sensor ? EX_OK : sensor.error().exitCode;
}

void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve) {
  publish::describe(sensor, description.message);
  traction::v1::Solver& solver = *description.message.mutable_solver();
  solver.set_mechanics(sensor.body                                     ? "influence file"
                       : solve.model == sensor::elastic::Model::kBlock ? "block"
                                                                       : "half-space");
  solver.set_noise_px(solve.noise_px);
  description.message.mutable_calibration()->set_id(publish::bytesOf(description.identity.calibration));
}

tl::expected<void, Error> readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile,
                                       publish::Beginning& beginning) {
  tl::expected<void, Error> done;
  const auto content = [&done](const std::string& file) {
    if (file.empty()) return std::string();
    const auto bytes = readWholeFile(file);
    if (bytes) return std::string(bytes->begin(), bytes->end());
    done = tl::unexpected(
        Error{.exitCode = EX_NOINPUT,
              .what = "the file cannot be read again for the recording, which lacks it: " + bytes.error().message(),
              .where = file,
              .remedy = "put it back, and record again"});
    return std::string();
  };
  beginning.message.set_gel(content(gelFile));
  beginning.message.set_influence(sensor.body ? content(sensor.body->file) : "");
  return done;
}

tl::expected<sensor::Sensor, Error> recordedSensor(const publish::Beginning& beginning, const std::string& recording,
                                                   const std::filesystem::path& scratch) {
  const std::string& gel = beginning.message.gel();
  if (gel.empty()) return sensor::Sensor();
  const bool hasInfluence = !beginning.message.influence().empty();
  if (hasInfluence) std::ofstream(scratch, std::ios::binary) << beginning.message.influence();
  auto sensor =
      hasInfluence ? sensor::parseGel(gel, recording, scratch.string()) : sensor::parseGelAlone(gel, recording);
  std::error_code ignored;
  std::filesystem::remove(scratch, ignored);
  if (sensor) return *std::move(sensor);
  return tl::unexpected(
      Error{.exitCode = EX_DATAERR, .what = "its gel file is damaged: " + sensor.error().what, .where = recording});
}

}  // namespace tractiond

// The gel file: one physical sensor in TOML, with a format version. config/gels/paper.toml shows every key except
// gel.influence_file, which names an influence file (docs/influence-file.md), and camera.surfaces (docs/sensor.md).
#pragma once

#include "base/toml_table.h"
#include "sensor/sensor.h"

#include <string>
#include <string_view>

namespace sensor {

using tractiond::FileError;
using tractiond::TomlTable;

/// Reads a gel file. Missing keys keep the paper's values; the version, each layer's colour and depth, and a
/// calibration's camera, date and hash are required. Also reads the influence file that the gel file names: keys of
/// what it gives are then errors, and a missing Young's modulus is that of the influence file. Does not compare
/// Calibration::hash with the content. Fails for invalid content, including an impossible sensor (Poisson's ratio of
/// 0.5 or more, markers outside the block ...) and an unknown key. The error has `isData` if the influence file is at
/// fault, and `unreadable` if it cannot be read.
/// \param name names the file in errors; the path of an influence file is relative to its folder
/// \param influence path of the influence file to read instead of the named one; empty: the named one
tl::expected<Sensor, FileError> parseGel(std::string_view text, const std::string& name,
                                         const std::string& influence = {});
/// Does the same with a text that must not make this program read another file: one that names an influence file is an
/// error.
tl::expected<Sensor, FileError> parseGelAlone(std::string_view text, const std::string& name);
/// Reads the gel file at `path`, of at most 4 MiB, as parseGel(). The error also has `unreadable` if the gel file
/// cannot be read.
tl::expected<Sensor, FileError> loadGel(const std::string& path);

/// Reads the tables of a gel that are part of a larger file: without a version, an influence file and what is
/// known of its creep. Faults are kept in `root` until its finish(): if that fails, the returned sensor must not be
/// used. Other keys of `root` are left for the caller to read.
Sensor readGel(TomlTable& root);

/// Returns the text of a gel file that parseGel() reads. Numbers have 15 digits. Of a body it holds the absolute path
/// of the influence file only. Leaves out Sensor::scatter and some keys that have their defaults. TOML cannot hold
/// a path that is not UTF-8: parseGel() fails for that text.
std::string gelText(const Sensor& sensor);

}  // namespace sensor

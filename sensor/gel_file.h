// The gel file: one physical sensor in TOML, with a format version. config/gels/paper.toml shows every key but
// gel.influence_file, which names the file of a body that is no block: docs/influence-file.md.
#pragma once

#include "sensor/sensor.h"
#include "sensor/toml_table.h"

#include <string>
#include <string_view>

namespace sensor {

/// Keys that are absent keep the paper's values, except the version. `name` is how errors call the file.
/// An impossible sensor (Poisson's ratio of a half or more, markers outside the block ...) is an error too. An
/// influence file that it names is read, too; its name counts from the folder of `name`. \param influence where it is
/// instead; empty: where it is named
tl::expected<Sensor, FileError> parseGel(std::string_view text, const std::string& name,
                                         const std::string& influence = {});
tl::expected<Sensor, FileError> loadGel(const std::string& path);

/// The same without a version and without finish(): for a file that holds the tables of a gel among others.
Sensor readGel(TomlTable& root);

/// The text of a gel file; 15 digits.
std::string gelText(const Sensor& sensor);

}  // namespace sensor

// A program's log: lines of spdlog on standard error, formatted for the journal or for a terminal.
#pragma once

#include "base/service/line_writer.h"

#include <spdlog/common.h>

#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

/// Returns a line with its prefix: the priority in systemd's journal, the program's name elsewhere.
std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text);

/// Sends spdlog's lines of this level ("debug", "info", "warning", "error") and above to standard error. No thread that
/// logs waits for the reader.
std::shared_ptr<LineWriter> startLog(const std::string& program, const std::string& level);

}  // namespace tractiond

// A program's log: spdlog's lines on standard error, as the journal or a person wants them.
#pragma once

#include "base/service/line_writer.h"

#include <spdlog/common.h>

#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

/// A line with what it begins with: its priority in systemd's journal, the program's name elsewhere.
std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text);

/// From now on spdlog's lines of this level ("debug", "info", "warning", "error") and above go to standard error, and
/// nobody who logs waits for who reads.
std::shared_ptr<LineWriter> startLog(const std::string& program, const std::string& level);

}  // namespace tractiond

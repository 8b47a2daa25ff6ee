// A program's log: spdlog's lines on standard error, in the form for the journal or for a terminal.
#pragma once

#include "base/service/line_writer.h"

#include <spdlog/common.h>

#include <memory>
#include <string>
#include <string_view>

namespace tractiond {

/// Returns `text` with its prefix: the priority for systemd's journal ("<3>") if logsToJournal(), else "program: ".
/// Adds no line end.
std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text);

/// Makes spdlog write lines of this level ("debug", "info", "warning", "error"; a word that spdlog does not know: none)
/// and above to standard error through the returned writer, so that no thread that logs waits for the reader. Each line
/// is a logLine(). Replaces spdlog's default logger, which shares the writer. The caller should drain() the writer
/// before the process ends.
std::shared_ptr<LineWriter> startLog(const std::string& program, const std::string& level);

}  // namespace tractiond

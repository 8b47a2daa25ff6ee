#include "base/service/log.h"

#include "base/service/service.h"

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <utility>

namespace tractiond {
namespace {

std::string prefix(std::string_view program, spdlog::level::level_enum level) {
  if (!logsToJournal()) return std::string(program) + ": ";
  switch (level) {
  case spdlog::level::critical:
  case spdlog::level::err:
    return SD_ERR;
  case spdlog::level::warn:
    return SD_WARNING;
  case spdlog::level::debug:
  case spdlog::level::trace:
    return SD_DEBUG;
  default:
    return SD_INFO;
  }
}

/// Passes lines to the writer, which needs no flush.
class LogSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  LogSink(std::string program, std::shared_ptr<LineWriter> log)
      : program_(std::move(program))
      , log_(std::move(log)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    log_->write(logLine(program_, message.level, {message.payload.data(), message.payload.size()}));
  }
  void flush_() override {}

  std::string program_;
  std::shared_ptr<LineWriter> log_;
};

}  // namespace

std::string logLine(std::string_view program, spdlog::level::level_enum level, std::string_view text) {
  return prefix(program, level).append(text);
}

std::shared_ptr<LineWriter> startLog(const std::string& program, const std::string& level) {
  auto log =
      std::make_shared<LineWriter>(STDERR_FILENO, LineWriterOptions{.prefix = prefix(program, spdlog::level::warn)});
  auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<LogSink>(program, log));
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(logger);
  return log;
}

}  // namespace tractiond

#include "tests/simulation/simulation.h"

#include "tests/simulation/run.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <functional>
#include <string>
#include <utility>

namespace tractiond::simulation {
namespace {

/// What the daemon logs is a part of what happens.
class Log : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  explicit Log(std::function<void(const std::string&)> say)
      : say_(std::move(say)) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    say_("log: " + std::string(message.payload.begin(), message.payload.end()));
  }
  void flush_() override {}

 private:
  std::function<void(const std::string&)> say_;
};

void breakLaw(Journal& journal, const Broken& broken) {
  journal.result.broken = broken;
  journal.say("BROKEN: " + broken.law + ": " + broken.what);
}

}  // namespace

Simulation::Simulation()
    : gel_(std::make_unique<Gel>()) {}

Simulation::~Simulation() = default;

Result Simulation::run(const Story& story) {
  clocks() = {1000 * kSecond, 1'700'000'000 * kSecond};
  forgetBackground();
  Run run(*gel_, story);
  Journal& journal = run.journal();
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "simulation", std::make_shared<Log>([&journal](const std::string& line) { journal.say(line); })));
  try {
    run.go();
  } catch (const Broken& broken) {
    breakLaw(journal, broken);
  } catch (const std::exception& thrown) {
    breakLaw(journal, {"no exception escapes", thrown.what(), journal.now_ms()});
  }
  spdlog::set_default_logger(before);
  journal.result.reached_ms = journal.now_ms();
  return std::move(journal.result);
}

}  // namespace tractiond::simulation

#include "tests/simulation/simulation.h"

#include "tests/simulation/run.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <exception>
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

/// Runs a story to its end, or until it breaks a law.
void complete(Run& run, const std::function<bool()>& goesOn) {
  Journal& journal = run.journal();
  try {
    run.go(goesOn);
  } catch (const Broken& broken) {
    breakLaw(journal, broken);
  } catch (const std::exception& thrown) {
    breakLaw(journal, {"no exception escapes", thrown.what(), journal.now_ms()});
  }
}

/// Runs a story in a world of its own.
Result runIn(std::unique_ptr<Run> run, const std::function<bool()>& goesOn) {
  Journal& journal = run->journal();
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "simulation", std::make_shared<Log>([&journal](const std::string& line) { journal.say(line); })));
  complete(*run, goesOn);
  spdlog::set_default_logger(before);
  journal.result.reached_ms = journal.now_ms();
  return std::move(journal.result);
}

}  // namespace

Simulation::Simulation()
    : gel_(std::make_unique<Gel>()) {}

Simulation::~Simulation() = default;

Result Simulation::run(const Story& story, const std::function<bool()>& goesOn) {
  clocks() = {1000 * kSecond, 1'700'000'000 * kSecond};
  forgetBackground();
  return runIn(std::make_unique<Run>(*gel_, story), goesOn);
}

}  // namespace tractiond::simulation

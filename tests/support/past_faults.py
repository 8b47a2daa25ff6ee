"""Faults that this repository has mended, each as what puts it back into today's code, for tools/mutations --past.

Each is one between the parts and the world: the simulation (docs/decisions/0034-simulation.md) must find it again.
"""

import collections

GATE, CAMERA, KEEPER = "daemon/capture/frame_gate.cpp", "daemon/capture/camera.cpp", "daemon/capture/keeper.cpp"
ZERO, WRITER = "daemon/control/zero_procedure.cpp", "daemon/control/zero_writer.cpp"
STORE = "daemon/control/zero_store.cpp"
PUBLISHER, CONTROL = "daemon/publish/publisher.cpp", "daemon/control/control_server.cpp"
SERVICE, RELOAD = "base/service/service_loop.cpp", "daemon/app/reload.cpp"
CALIBRATION, STEPS = "daemon/calibrate/calibration.cpp", "daemon/control/step_runner.cpp"

# Edits: file, text that stands there once, what it becomes.
Fault = collections.namedtuple("Fault", "name commit what edits")

FAULTS = [Fault(*one) for one in [
    ("thrown-frames", "5d04c00", "frames that the driver throws away, as where the camera counts anew, are lost unseen", [
        (GATE, "thrown_ += arrival.thrown;", ""),
    ]),
    ("no-clock", "34882e1", "a camera whose clock goes wrong is refused frame by frame", [
        (GATE, "return step <= most ? Fit::kByTheHosts : Fit::kNone;", "return step < 0 * most ? Fit::kByTheHosts : Fit::kNone;"),
    ]),
    ("other-pictures", "34882e1", "a camera whose pictures have changed is not opened anew", [
        (CAMERA, "giveUp(Loss::kOtherPictures);", "lastWhole_ns_ = buffer.arrival.host_ns;"),
    ]),
    ("slow-doubt", "9d69b3b", "a camera that is gone is noticed by its silence alone", [
        (CAMERA, "keeper_->doubt(lastArrival_ns_);", ""),
    ]),
    ("read-that-hangs", "4f9b281", "the keeper waits for a read of registers, while the camera is gone", [
        (KEEPER, "calls_->run([driver = driver_, to = answers_, what = std::move(what)] { what(*driver, *to); });",
         "what(*driver_, *answers_);"),
    ]),
    ("refused-settings", "56a99ad", "settings that the camera refuses are not taken back", [
        (KEEPER, "if (former_ && problem.exitCode != EX_UNAVAILABLE && problem.exitCode != EX_TEMPFAIL) {",
         "if (former_ && problem.exitCode == EX_OK) {"),
    ]),
    ("half-reload", "56a99ad", "what is new in a configuration is taken beside a key that needs a restart", [
        (RELOAD, "  if (!bound.empty()) {\n", "  if (!bound.empty() && ofCamera) inForce_.camera = read.config.camera, camera_.reopen();\n"
         "  if (!bound.empty()) spdlog::set_level(spdlog::level::from_str(read.config.logLevel));\n"
         "  if (!bound.empty()) {\n"),
    ]),
    ("others-hang", "6fa4791", "the watchdog is fed while a library hangs", [
        ("base/service/service.h", "return watch_.allAdvanced() && others;", "return watch_.allAdvanced() && (others || true);"),
    ]),
    ("search-that-hangs", "19f3eb5", "a search for a lost camera that hangs goes on for ever", [
        ("daemon/capture/keeper.h", "return !lent_.load(std::memory_order_relaxed) && clock_() > due_ns_;", "return false;"),
    ]),
    ("before-the-disk", "a00813e", "a zero is in force before it is on the disk", [
        (ZERO, "    return keep({.zero = taken_, .report = report,",
         "    putInForce(taken_, report);\n"
         "    return keep({.zero = taken_, .report = report,"),
        (ZERO, "writer_.writeRequested(keeping.zero, &*zero_, until_ns);",
         "writer_.writeRequested(keeping.zero, keeping.zero.id == zero_->id ? before() : &*zero_, until_ns);"),
    ]),
    ("reload-waits", "a00813e", "the thread that feeds the watchdog reads the configuration", [
        (SERVICE, "apply_ = reader_->start(read_);",
         "std::promise<std::function<void()>> read;\n  read.set_value(read_());\n  apply_ = read.get_future();"),
    ]),
    ("stop-waits", "c504d05", "a stop waits for a reload whose file a disk does not give", [
        ("base/service/service.h", "explicit Reload(const std::function<std::function<void()>()>& read)",
         "~Reload() {\n      if (reader_) reader_->awaitIdle();\n    }\n"
         "    explicit Reload(const std::function<std::function<void()>()>& read)"),
    ]),
    ("unheard", "fc93d4b", "systemd that reads nothing for a moment never hears that the service is ready", [
        (SERVICE, 'isUnderWay_ = !systemd::notify("READY=1");', 'systemd::notify("READY=1");\n  isUnderWay_ = false;'),
        (SERVICE, "if (!isReadyTold_) isReadyTold_ = tellReady();", ""),
    ]),
    ("answered-twice", "f602e20", "a step of a calibration answers an undo that is being written", [
        (ZERO, "if (!std::holds_alternative<Taking>(state_)) return;  // the end of the write is the answer",
         "if (std::holds_alternative<Idle>(state_)) return;\n"
         "  if (std::holds_alternative<Keeping>(state_)) return parts_.replies.answerZero(tl::unexpected(reason), {});"),
    ]),
    ("judged-late", "490b865", "a zero is judged when it has been written", [
        (ZERO, ".report = parts_.gel.compare(*before_)", ".report = GelReport()"),
        (ZERO, "const GelReport report = parts_.gel.compare(taken_);",
         "const GelReport report = zero_ ? GelReport() : parts_.gel.compare(taken_);"),
        (ZERO, "putInForce(kept.zero, kept.report);", "putInForce(kept.zero, parts_.gel.compare(kept.zero));"),
    ]),
    ("written-once", "86d8f71", "a zero in force that could not be written is not written later", [
        (WRITER, "if (!written) dueAt_ns_ = clock_() + kTryAgain_ns;", "if (!written && kTryAgain_ns < 0) dueAt_ns_ = clock_();"),
        (WRITER, "if (ended == State::kRefused || !written) dueAt_ns_ = clock_();",
         "if (ended == State::kRefused) dueAt_ns_ = clock_();"),
    ]),
    ("names-unsynchronised", "86d8f71", "a directory that could not be synchronised is taken for success", [
        ("base/whole_file.h", 'return synchroniseNames(path.has_parent_path() ? path.parent_path() : std::filesystem::path("."));',
         'synchroniseNames(path.has_parent_path() ? path.parent_path() : std::filesystem::path("."));\n  return {};'),
    ]),
    ("late-answer", "86d8f71", "a zero that waited for an earlier write has a minute of its own", [
        (ZERO, "std::min(options_.clock(), taking->until_ns) + kKeptWithin_ns;", "options_.clock() + kKeptWithin_ns;"),
    ]),
    ("undo-of-itself", "d272933", "after a loss of power between the two files an undo restores the zero in force", [
        (STORE, "if (earlier && *earlier && restored && (*earlier)->id == restored->id) return std::nullopt;",
         "if (earlier && *earlier && !restored) return std::nullopt;"),
    ]),
    ("restored-unsynchronised", "19e1e43", "a zero that is restored may be taken back by a loss of power", [
        (STORE, "if (restored.zero) restored.unsynchronised = synchroniseNames(stateDirectory);", ""),
    ]),
    ("refused-zero-comes", "3fa57ca", "a zero that was refused because no frames came is taken when they do", [
        (ZERO, "if (parts_.tracker.cancelZero() || parts_.tracker.zeroState() != track::ZeroState::kTaken)\n    answer(tl::unexpected(reason));",
         "answer(tl::unexpected(reason));"),
        (ZERO, "if (zero_ && !(taking && taken_.requested)) return handOver();", "if (zero_ && !taken_.requested) return handOver();"),
        (ZERO, "std::min(options_.clock(), taking->until_ns) + kKeptWithin_ns;",
         "(taking ? std::min(options_.clock(), taking->until_ns) : options_.clock()) + kKeptWithin_ns;"),
    ]),
    ("endless-step", "3fa57ca", "a step of a calibration that sees too few markers does not end", [
        (CALIBRATION, "if (!result) result = overdue(field);", ""),
    ]),
    ("zero-of-a-load", "0a43a42", "a load is zeroed by mistake", [
        (ZERO, "if (zero_ && !touch.empty() && !request_.anyway)", "if (zero_ && !touch.empty() && false)"),
    ]),
    ("step-waits", "531954f", "the control thread waits for the file of a calibration", [
        (STEPS, "  work_ = {.done = parts_.host.start(std::move(work)), .until_ns = options_.clock() + kWorkWithin_ns};",
         "  std::promise<std::optional<Result>> done;\n"
         "  done.set_value(work());\n"
         "  work_ = {.done = done.get_future(), .until_ns = options_.clock() + kWorkWithin_ns};"),
    ]),
    ("passed-on", "8964da1", "a request that is passed on is not answered through who passed it on", [
        (CONTROL, "if (!route.beyond.empty()) put(*beyond, ZMQ_SNDMORE);", ""),
    ]),
    ("latest-forgotten", "43d31144", "a gateway whose subscription to latest is lost sends no latest field", [
        ("gateway/relay.cpp", "    subscribeAgain(now);\n", ""),
    ]),
    ("short-links", "795f824", "links are too short for a stall of 80 ms", [
        ("daemon/app/pipeline.h", "Link<Frame, kSlots> frames_;", "Link<Frame, 4> frames_;"),
        ("daemon/app/pipeline.h", "Link<TractionField, kSlots> fields_;", "Link<TractionField, 4> fields_;"),
    ]),
]]

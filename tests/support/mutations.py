"""Breaks the code on purpose, a line at a time, and tells whether the gate notices.

usage: mutations.py list [ROOM...]          prints the mutations; each must fit the committed tree
       mutations.py run PROJECT [ROOM...]   makes them in PROJECT, a clone of it, one after another
Exit codes: those of tools/mutations.
"""

import collections
import contextlib
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree

import tally

SOURCE = pathlib.Path(__file__).resolve().parents[2]

# Room: build; the gate's tests in which the room is tested; file; what is broken; text on one line; what it becomes.
# The text stands in its file once. What a mutation breaks compiles without a warning, and makes no test wait for ever.
ROOMS = {
    "base": [
        ("tsan", "base", "base/mailbox.h", "who takes does not see all that was put",
         "if (!state_.compare_exchange_strong(full, State::kBusy, std::memory_order_acquire)) return false;",
         "if (!state_.compare_exchange_strong(full, State::kBusy, std::memory_order_relaxed)) return false;"),
        ("tsan", "base", "base/link.h", "what is evicted is not counted",
         "evicted_.add();",
         "evicted_.add(0);"),
        ("tsan", "network|client", "base/network/socket_file.cpp", "a socket is taken from the daemon that is at it",
         "error = isConnected ? 0 : errno;",
         "error = ECONNREFUSED;"),
        ("asan", "keys", "base/network/keys.cpp", "a key of which the permission was changed keeps the old one",
         "if (!failure && listed_ && now == stamps_) return false;",
         "if (!failure && listed_ && now.size() == stamps_.size()) return false;"),
        ("asan", "keys", "base/network/keys.cpp", "a secret key that everybody can read is taken",
         "(of.st_uid == 0 ? 037 : 077)",
         "(of.st_uid == 0 ? 030 : 070)"),
    ],
    "capture": [
        ("tsan", "capture", "daemon/capture/frame_gate.cpp", "a camera's 16-bit counter wraps one id later",
         "kLast16BitId = 65535;",
         "kLast16BitId = 65536;"),
        ("tsan", "capture", "daemon/capture/device_clock.cpp", "the drift of a camera's clock has the other sign",
         "const Point point{host, host - device};",
         "const Point point{host, device - host};"),
        ("tsan", "capture", "daemon/capture/stream_filter.cpp", "a packet behind a frame's last reaches the driver",
         "program.jump(BPF_JGT, blocks, Program::kRefuse, Program::kNext);",
         "program.jump(BPF_JGT, blocks + 1, Program::kRefuse, Program::kNext);"),
        ("tsan", "capture", "daemon/capture/clock_asker.cpp", "a clock that refuses to be asked is asked for ever",
         "refusals_ = answer == kRefused ? refusals_ + 1 :",
         "refusals_ = answer == kRefused ? 1 :"),
        ("tsan", "capture", "daemon/capture/last_will.cpp", "a camera that was closed is given free all the same",
         "tellExecutor(will().executor, {}, -1);",
         "tellExecutor(-1, {}, -1);"),
    ],
    "track": [
        ("release", "track", "daemon/track/tracker_zero.cpp", "a zero is in force before anybody has judged it",
         "if (!options_.awaitsGelCheck || isFirst) install(pose_);",
         "if (options_.awaitsGelCheck || isFirst) install(pose_);"),
        ("release", "track_centre", "daemon/track/centre.cpp", "a mosaic's centres are told to be better than they are",
         "noise * plane.scale * plane.scale / (amplitude * amplitude);",
         "noise * plane.scale / (amplitude * amplitude);"),
        ("release", "track", "daemon/track/zero.cpp", "a zero is taken while the camera shakes",
         "common_.squared() / (frames * frames) > kShake_px * kShake_px) return true;",
         "common_.squared() / (frames * frames) > kShake_px) return true;"),
        ("release", "track", "daemon/track/tracker.cpp", "a zero that nobody asked for is called verified",
         "if (zeroWasRequested_ && agreeing_ >= kAgreeingFrames) verified_ = true;",
         "if (agreeing_ >= kAgreeingFrames) verified_ = true;"),
        ("release", "track_own_shape", "daemon/track/appearance.cpp", "every marker is taken to be of the typical size",
         "constexpr int kLeastStep = -20, kMostStep = 12;", "constexpr int kLeastStep = 0, kMostStep = 0;"),
        ("release", "track_own_shape", "daemon/track/centre_errors.cpp", "a marker's own shape is forgotten",
         "return std::clamp(shape_[static_cast<std::size_t>(marker)], typicalShape_, kMostOwnShape * typicalShape_);",
         "return std::max(0.0F * shape_[static_cast<std::size_t>(marker)], typicalShape_);"),
    ],
    "solve": [
        ("release", "solve|solve_body", "daemon/solve/field_rules.cpp", "x and y of the centre of pressure are swapped",
         "field.centreOfPressure_m = {-field.moment_Nm[1] / z, field.moment_Nm[0] / z};",
         "field.centreOfPressure_m = {field.moment_Nm[0] / z, -field.moment_Nm[1] / z};"),
        ("release", "solve_touch", "daemon/solve/used_markers.cpp", "doubtful markers count like all others",
         "constexpr double kDoubtful = 16.0;",
         "constexpr double kDoubtful = 1600.0;"),
        ("release", "solve|solve_body", "daemon/solve/factors_cache.cpp", "another window keeps the old one's factors",
         "hasher.value(camera.windowThickness);",
         "hasher.value(camera.windowIndex);"),
    ],
    "publish": [
        ("tsan", "publish|client", "daemon/publish/publisher.cpp", "each subscription is answered with a description",
         "if (descriptionDue && due(now, lastDescription_ns, options.descriptionInterval)) sendDescription();",
         "if (descriptionDue) sendDescription();"),
        ("tsan", "control|client", "daemon/control/control_server.cpp", "who joins a zero has another taken",
         "if (!first) return;",
         "if (!first && wanted.undo) return;"),
    ],
    "calibrate": [
        ("release", "calibrate", "daemon/calibrate/stiffness_fit.cpp", "a weight's own modulus is the inverse of it",
         "assumed * one.weight_N / one.read_N",
         "assumed * one.read_N / one.weight_N"),
        ("release", "calibrate", "daemon/calibrate/calibration.cpp", "the weight before is read once more",
         "if (moved || !load.found() || !isNew) {",
         "if (moved || !load.found()) {"),
        ("release", "calibrate", "daemon/calibrate/calibration.cpp", "a gel file that was changed is believed",
         "if (!sensor.calibration || sensor.calibration->hash == calibrationHash(sensor)) return {};",
         "if (!sensor.calibration || !sensor.calibration->hash.empty()) return {};"),
    ],
    "pipeline": [
        ("tsan", "pipeline", "daemon/app/pipeline.cpp", "a field is stamped as solved when its frame came",
         "field.markers.info.times.solved_ns = monotonicNow();",
         "field.markers.info.times.solved_ns = markers.info.times.received_ns;"),
    ],
    "records": [
        ("tsan", "publish|capture", "cmake/ledger.cmake", "what is evicted is missing from the account",
         'if(field MATCHES "frames_lost_total")',
         'if(field MATCHES "frames_lost_total" AND NOT name MATCHES "evicted")'),
        ("asan", "records", "daemon/records/snapshot.cpp", "of two packed samples the second is another byte",
         "(sample % 2 == 0 ? 0 : 2)",
         "(sample % 2 == 0 ? 0 : 1)"),
    ],
    "sensor": [
        ("asan", "gel_file", "sensor/gel_file.cpp", "millimetres of the window are taken for metres",
         'table.read("window_thickness_mm", camera.windowThickness, {0.0, 1000, kMillimetres});',
         'table.read("window_thickness_mm", camera.windowThickness, {0.0, 1000});'),
        ("release", "projection", "sensor/projection.cpp", "the derivative of the lens's distortion lacks a factor",
         "const double scaleByR2 = camera_.k1 + 2.0 * camera_.k2 * r2;",
         "const double scaleByR2 = camera_.k1 + camera_.k2 * r2;"),
        ("release", "half_space", "sensor/elastic/half_space.cpp", "a press moves the gel the wrong way along y",
         "u(1, 2) = y * (z * inverseSquare - lean);",
         "u(1, 2) = y * (z * inverseSquare + lean);"),
    ],
    "gateway": [
        ("asan", "gateway", "gateway/request.cpp", "who asks may say that he is somebody else",
         "request.set_on_behalf_of(asker);",
         "if (request.on_behalf_of().empty()) request.set_on_behalf_of(asker);"),
    ],
    "client": [
        ("tsan", "client", "client/src/subscriber.cpp", "C++: a gap is one message, however long it is",
         "lost += header.sequence - sequence - 1;",
         "++lost;"),
        ("tsan", "client", "client/src/control.cpp", "C++: a zero of many frames is not waited for",
         "encodeZero({.anyway = options.anyway}), std::max(options_.zeroTimeout, zeroTakes())",
         "encodeZero({.anyway = options.anyway}), options_.zeroTimeout"),
        ("release", "clients.conformance", "client/src/decode.cpp", "C++: a displacement may be no number",
         "requireFinite(markers.displacement_px, markers.variance_px2);",
         "requireFinite(markers.variance_px2);"),
        ("release", "cli", "client/cli/board.cpp", "tractionctl top: rates are wrong where a status was lost",
         "const double seconds = (*scene.status)->uptime_s() - (*scene.statusBefore)->uptime_s();",
         "const double seconds = 1.0;"),
        ("release", "client.camera", "client/cli/camera.cpp", "tractionctl camera: what stands at 0 is called changed",
         "std::abs(*a - *b) <= 1e-9",
         "std::abs(*a - *b) < 1e-9"),
        ("release", "client.record", "client/cli/recordings.cpp", "tractionctl info: each message counts as a loss",
         "lost += message.sequence - sequence - 1;",
         "lost += message.sequence - sequence;"),
        ("release", "clients.conformance", "client/python/traction/decode.py", "Python: one finite number is enough",
         "_require(0 not in np.isfinite(array).tobytes(), ",
         "_require(1 in np.isfinite(array).tobytes(), "),
        ("release", "client.python", "client/python/traction/keys.py", "Python: a key that everybody can read is taken",
         "(0o037 if owner == 0 else 0o077)",
         "(0o030 if owner == 0 else 0o070)"),
    ],
    "lens": [
        ("release", "lens_fit", "lens/lens_fit.cpp", "a lens keeps its first number of distortion twice",
         "fit.camera.k2 = model.distortion.at<double>(1);",
         "fit.camera.k2 = model.distortion.at<double>(0);"),
        ("release", "lens", "lens/first_pose.cpp", "a turned camera is put where it is not",
         "camera.position = -toCamera.transpose() * shift;",
         "camera.position = -toCamera * shift;"),
        ("release", "picture_file", "lens/picture_file.cpp", "a picture of twelve bits is read as nearly black",
         "most > 0.0 ? 255.0 / most : 1.0);",
         "most > 0.0 ? 255.0 / 65535.0 : 1.0);"),
        ("release", "sheet", "lens/sheet.cpp", "the sheet is mirrored where it should not be",
         "const double side = options.mirrored ? -1.0 : 1.0;",
         "const double side = options.mirrored ? 1.0 : -1.0;"),
    ],
    "twin": [
        ("release", "film", "sensor/projection.cpp", "a warm picture rolls the other way",
         "r.x(), -r.y() / camera_.aspect, 0.0, 1.0, r.y(), r.x() * camera_.aspect;",
         "r.x(), r.y() / camera_.aspect, 0.0, 1.0, r.y(), -r.x() * camera_.aspect;"),
        ("release", "scenario", "twin/scenario.cpp", "the true moment about y has the other sign",
         "-p.x() * f.z()",
         "p.x() * f.z()"),
        ("release", "renderer", "twin/renderer.cpp", "far markers hide those before them",
         "nearer.depth <= layer.depth",
         "nearer.depth >= layer.depth"),
    ],
    "config": [
        ("asan", "config", "base/service/config_table.cpp", "localhost.example is taken for this host",
         '"tcp://localhost:"',
         '"tcp://localhost"'),
        ("asan", "config", "daemon/app/config_toml.cpp", "a gel file is sought where the daemon was started",
         "std::filesystem::path(path).parent_path() / config->sensor.gelFile;",
         "std::filesystem::absolute(config->sensor.gelFile);"),
    ],
    "manual": [
        ("release", "tools.manual", "manual/mdoc.py", "a line that begins with an apostrophe is a command",
         """if line[0] in ".'" else line)""",
         """if line[0] == "." else line)"""),
        ("release", "tools.manual", "manual/table.py", "the value of an option is taken for a command",
         "if one.value for name in one.names",
         "if not one.value for name in one.names"),
        ("release", "tools.manual", "manual/table.py", "the program's option hides the command's own",
         "if not names & set(one.names)]",
         "if one.names]"),
    ],
    "recording": [
        ("asan", "recording", "recording/reader.cpp", "the chunk in which reading is to begin is passed over",
         "return in.number<std::uint64_t>() < since_ns_;",
         "return in.number<std::uint64_t>() <= since_ns_;"),
        ("asan", "recording", "recording/reader.cpp", "a damaged chunk is read as if it were whole",
         "(chunk->crc != 0 && crcOf(records) != chunk->crc)", "(chunk->crc != 0 && records.empty())"),
    ],
}

Mutation = collections.namedtuple("Mutation", "room number preset tests file what old new")
FAILED = (  # the names of cases that a test program says failed
    r"(?<=^\[  FAILED  \] )[\w/]+\.[\w/]+(?=.* \(\d+ ms\)$)|(?<=^FAIL: )\w+|(?<=^ERROR: )\w+|"
    r"ThreadSanitizer: data race")


def edit_misfit(file, old, new):
    """Returns why a text cannot be replaced in the committed tree, else None."""
    shown = subprocess.run(["git", "show", f"HEAD:{file}"], cwd=SOURCE, stdout=subprocess.PIPE, text=True)
    fits = shown.stdout.count(old) == 1 and old != new
    return None if fits else f"{file} has '{old}' {shown.stdout.count(old)} times, not once"


def misfit(one, gate):
    """Returns why a mutation cannot be made, else None. \\param gate (preset, test) of all that there are"""
    if "\n" in one.old + one.new:
        return f"'{one.old}' is more than a line"
    if why := edit_misfit(one.file, one.old, one.new):
        return why
    absent = {(one.preset, test) for test in one.tests.split("|")} - gate.keys()
    return f"no gate has {absent}" if absent else None


def build(project, preset, log=None):
    """Builds what the gate of a preset runs; returns whether it could. Without a log stderr tells how far it is."""
    return subprocess.run(["tools/build", preset, "gate"], cwd=project, stdout=log, stderr=log).returncode == 0


def failures(project, preset, tests, log):
    """Runs tests of the gate. Returns of each that failed its name, and what in it failed."""
    report = project / "build" / preset / "mutation.xml"
    report.unlink(missing_ok=True)
    subprocess.run(["ctest", "--preset", preset, "-L", "^gate$", "-R", f"^({tests})$", "--no-tests=error", "--parallel",
                    str(os.cpu_count() + 1), "--output-junit", report, "--test-output-size-failed", "1000000"],
                   cwd=project, stdout=log, stderr=log)
    failed = []
    for case in xml.etree.ElementTree.parse(report).iter("testcase"):
        if case.get("status") != "run":
            words = [*dict.fromkeys(re.findall(FAILED, case.findtext("system-out") or "", re.M))] or ["ended early"]
            failed.append(f"{case.get('name')}: {words[0]}" + (f" and {len(words) - 1} more" if words[1:] else ""))
    return failed


@contextlib.contextmanager
def made(project, edits):
    """Replaces texts in files of the project, and takes that back. \\param edits (file, old, new)"""
    before = {file: (project / file).read_text() for file, _, _ in edits}
    try:
        for file, old, new in edits:
            (project / file).write_text((project / file).read_text().replace(old, new))
        yield
    finally:
        for file, text in before.items():
            (project / file).write_text(text)


def log_folder(project):
    """Returns the folder for logs beside the project, made if it is not there."""
    logs = project.parent / "log"
    logs.mkdir(exist_ok=True)
    return logs


def verdict(project, one, log):
    """Makes a mutation, tells what comes of it, and takes it back."""
    with made(project, [(one.file, one.old, one.new)]):
        if not build(project, one.preset, log):
            return f"DOES NOT BUILD: {log.name}"
        failed = failures(project, one.preset, one.tests, log)
        return f"RED by {'; '.join(failed)}" if failed else f"NOT NOTICED: {log.name}"


def run(project, chosen):
    """Makes mutations, those of one build after another, and prints what comes of each; returns the exit code."""
    logs, red = log_folder(project), 0
    for preset in sorted({one.preset for one in chosen}):
        of_preset = [one for one in chosen if one.preset == preset]
        if not build(project, preset):
            return 1
        with open(logs / f"{preset}.log", "w") as log:
            failed = failures(project, preset, "|".join(sorted({one.tests for one in of_preset})), log)
        if failed:
            print(f"mutations: without any, {'; '.join(failed)}: {log.name}", file=sys.stderr)
            return 8
        for one in of_preset:
            with open(logs / f"{one.room}-{one.number}.log", "w") as log:
                told = verdict(project, one, log)
            red += told.startswith("RED")
            print(f"{one.room:9}  {one.what:59}  {told}", flush=True)
    print(f"{red} of {len(chosen)} mutations were noticed")
    return 0 if red == len(chosen) else 8


def main(verb, *words):
    project, rooms = (pathlib.Path(words[0]).resolve(), words[1:]) if verb == "run" else (None, words)
    unknown = [room for room in rooms if room not in ROOMS]
    if unknown:
        print(f"mutations: no room is called '{unknown[0]}': {', '.join(ROOMS)}", file=sys.stderr)
        return 64
    chosen = [Mutation(room, number, *one) for room in ROOMS if not rooms or room in rooms
              for number, one in enumerate(ROOMS[room], 1)]
    gate = tally.expected_cases()
    faults = [f"mutations: {one.room}, {one.what}: {why}" for one in chosen if (why := misfit(one, gate))]
    if faults:
        print("\n".join(faults), file=sys.stderr)
        return 65
    if verb == "run":
        return run(project, chosen)
    for one in chosen:
        print(f"{one.room:9}  {one.what:59}  {one.preset} {one.tests}", one.file, f"  - {one.old}", f"  + {one.new}",
              sep="\n           ")
    print(f"{len(chosen)} mutations; each fits the committed tree")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)

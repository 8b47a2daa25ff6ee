"""What tools/bench prints: each figure, measured now on this machine, beside its target."""

import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import rig
from target import bounds

TICKS = os.sysconf("SC_CLK_TCK")


def row(figure, measured, target="", value=None):
    """`value` is held against the target; a figure without one is only printed."""
    verdict = ""
    if value is not None and target:
        least, most = bounds(target)
        verdict = "ok" if least <= value <= most else "MISSED"
    print(f"{figure:66s} {measured:>26s}   {target:12s} {verdict}", flush=True)


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout


def json_lines(path):
    with open(path) as lines:
        return [json.loads(line) for line in lines if line.endswith("\n")]


def cpu_seconds(pid):
    words = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / TICKS


def memory_mb(pid):
    """Resident now, and at most since the start."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return tuple(int(re.search(rf"{name}:\s+(\d+)", status)[1]) / 1024 for name in ("VmRSS", "VmHWM"))


def live(scenario, seconds, config="", record=False):
    """Twin, daemon and subscriber as processes: (fields, truth, daemon, its share of a core from the first load of a shipped
    scenario on, its memory [MB] at the end and at most)."""
    with rig.Rig() as bench:
        twin = bench.twin(scenario, ready=False)
        daemon = bench.daemon(config, *(("--record", bench.folder / "live.mcap") if record else ()))
        subscriber = bench.subscribe(daemon)
        subscriber.collect(1)
        # In memory: who writes to the disk that is recorded on waits for it, and reads its next message late.
        memory = bench.enter_context(tempfile.TemporaryDirectory(dir="/dev/shm"))
        output = pathlib.Path(memory) / "fields.jsonl"
        with open(output, "w") as file:
            echo = subprocess.Popen([rig.BIN / "tractionctl", "echo", "--connect", daemon.endpoint["stream"],
                                     "--topic", "field"], stdout=file)
        subscriber.socket.close(0)  # only the measured subscriber stays
        time.sleep(6.0)  # the zero's solver is made, and the load is on
        cpu, since = cpu_seconds(daemon.child.pid), time.monotonic()
        time.sleep(seconds)
        cpu = (cpu_seconds(daemon.child.pid) - cpu) / (time.monotonic() - since)
        memory_MB = memory_mb(daemon.child.pid)
        echo.terminate()
        echo.wait()
        daemon.stop()
        twin.stop()
        return json_lines(output), rig.read_truth(twin), daemon, cpu, memory_MB


def latency_ms(fields, until="arrived_ns"):
    """Frame popped -> message received, or another of a field's times: p50, p99."""
    latency = sorted((field[until] - field["received_ns"]) * 1e-6 for field in fields)
    return latency[len(latency) // 2], latency[len(latency) * 99 // 100]


def under_load(load, fields, truth):
    """While the scenario's load is largest: the share of the frames that is lost, the latency of the others, and how they
    were solved."""
    force_N = {frame: np.linalg.norm(shown["force_N"]) for frame, shown in truth.items()}
    frames = [frame for frame in force_N if force_N[frame] >= max(force_N.values()) * (1 - 1e-6)]
    held = [field for field in fields if field["camera_frame_id"] in frames]
    first, last = (frames.index(field["camera_frame_id"]) for field in (held[0], held[-1]))
    valid = sum(field["valid"] for field in held)
    row(f"{load}, {last - first + 1} frames at 60 frames/s: lost", f"{100 * (1 - len(held) / (last - first + 1)):.1f} %")
    row("    published, but not solved in time", f"{100 * (1 - valid / len(held)):.1f} %")
    p50, p99 = latency_ms(held, "sent_ns")
    row("    frame popped -> message sent, p50 and p99", f"{p50:.1f}, {p99:.1f} ms")
    p50, p99 = latency_ms(held)
    row("    frame popped -> message received, p50", f"{p50:.1f} ms")
    row("                                      p99", f"{p99:.1f} ms")
    linear = [field for field in held if field["solution"] == "linear"]
    if not linear:
        return
    row("    answered by the model of an earlier frame", f"{100 * len(linear) / len(held):.1f} %")
    p50, p99 = latency_ms(linear)
    row("        frame popped -> message received, p50", f"{p50:.1f} ms", "<= 0.8 ms")
    row("                                          p99", f"{p99:.1f} ms", "<= 2 ms")


def fewer_models(seconds):
    """What a press costs where the processor is wanted for other things."""
    _, _, _, cpu, _ = live("press", seconds, "[solve]\nmodels_hz = 10\n")
    row("processor time with solve.models_hz = 10", f"{100 * cpu:.1f} % of a core", "<= 10 %", cpu)


def touch():
    """What traction-touch adds to a field, and what it costs."""
    with rig.Rig() as bench:
        bench.twin("press", ready=False)
        daemon = bench.daemon()
        process = bench.start(rig.BIN / "traction-touch", "--connect", daemon.endpoint["stream"], "--runtime",
                              bench.folder / "touch")
        process.wait_for("listening.*ipc")
        process.endpoint = {"stream": f"ipc://{bench.folder / 'touch' / 'stream'}"}
        fields, contacts = bench.subscribe(daemon, "traction/v1/default/field"), bench.subscribe(process, "traction/v1/default/contacts")
        fields.collect(360)  # the zero's solver is made, and the load is on
        cpu, since = cpu_seconds(process.child.pid), time.monotonic()
        sent_ns = {field.header.frame_number: field.header.sent_ns for field in fields.collect(600)}
        cpu = (cpu_seconds(process.child.pid) - cpu) / (time.monotonic() - since)
        added = sorted(1e-6 * (each.header.sent_ns - sent_ns[each.header.frame_number]) for each in contacts.collect(960, "contacts")
                       if each.header.frame_number in sent_ns)
    row("field sent -> contacts sent, p50", f"{added[len(added) // 2]:.2f} ms")
    row("                             p99", f"{added[len(added) * 99 // 100]:.2f} ms", "<= 1 ms", added[len(added) * 99 // 100])
    row("    processor time of traction-touch", f"{100 * cpu:.1f} % of a core", "<= 5 %", cpu)


def loads():
    own = rig.SOURCE / "tests/bench/loads"
    for load, scenario in (("untouched", "idle"), ("two contacts", "two_contacts"),
                           ("four contacts", own / "four_contacts.toml"), ("a palm", own / "palm.toml")):
        fields, truth, *_ = live(scenario, 10)
        under_load(load, fields, truth)


def served(bench, scenario, rate_hz, pixel_format, config="", before=()):
    """Frames of a load of 4 s that was drawn before, over and over, so that the twin takes no more of the processors than a
    camera's network: the share that is lost or has no interval, and the latency of what came."""
    pictures = pathlib.Path(bench.enter_context(tempfile.TemporaryDirectory(dir="/dev/shm"))) / "pictures.raw"
    options = ("--format", pixel_format, "--rate", rate_hz)
    run(rig.BIN / "traction-twin", scenario, "--cache", rig.cache_directory(), *options, "--seconds", 4, "--images", pictures)
    twin = bench.twin(scenario, *options, "--serve", pictures, truth=False, ready=False)
    daemon = bench.daemon(config, before=before, instance=scenario.stem)
    subscriber = bench.subscribe(daemon, "traction/v1/" + scenario.stem + "/field")
    subscriber.collect(4 * rate_hz)  # the zero, and the first contacts
    cpu, since, fields = cpu_seconds(daemon.child.pid), time.monotonic(), []
    while time.monotonic() - since < 12:
        received = subscriber.receive(1.0)
        if received is not None:
            fields.append((received[1], time.monotonic_ns()))
    cpu = (cpu_seconds(daemon.child.pid) - cpu) / (time.monotonic() - since)
    subscriber.socket.close(0)
    daemon.stop()
    twin.stop()
    pictures.unlink()
    frames = fields[-1][0].header.frame_number - fields[0][0].header.frame_number + 1
    without = 1 - sum(field.valid for field, _ in fields) / frames
    latency = sorted((arrived_ns - field.header.received_ns) * 1e-6 for field, arrived_ns in fields)
    row(f"    of {frames} frames lost", f"{100 * (1 - len(fields) / frames):.1f} %")
    row("    lost, or published without an interval", f"{100 * without:.1f} %", "<= 5 %", without)
    row("    frame popped -> message received, p50", f"{latency[len(latency) // 2]:.1f} ms")
    row("                                      p99", f"{latency[len(latency) * 99 // 100]:.1f} ms")
    row("    processor time of the daemon", f"{100 * cpu:.1f} % of a core")


def fast_cameras():
    own = rig.SOURCE / "tests/bench/loads"
    for loops in (0, 2):
        for load in ("fast_press", "fast_slide", "fast_roll"):
            with rig.Rig() as bench:
                busy = [bench.start(sys.executable, "-c", "while True: pass") for _ in range(loops)]
                print(f"{load} at 200 frames/s{', beside two busy loops' if busy else ''}")
                served(bench, own / f"{load}.toml", 200, "RGB8")
    with rig.Rig() as bench:
        print("a gel of 7 x 10 dots, 320 x 240, at 1,000 frames/s, the daemon on one processor")
        served(bench, own / "small_gel_press.toml", 1000, "Mono8", f'[sensor]\ngel_file = "{own / "small_gel.toml"}"\n',
               before=("taskset", "-c", "1"))


def sixty_frames_per_second(seconds):
    fields, truth, daemon, cpu, memory = live("press", seconds)
    numbers = [field["frame_number"] for field in fields]
    lost = numbers[-1] - numbers[0] + 1 - len(numbers)
    ledger = re.search(r"(\d+) frames received, (\d+) published, (\d+) for the zero, (\d+) lost", daemon.output())
    received, *accounted = map(int, ledger.groups())
    row(f"{len(numbers)} frames at 60 frames/s: lost", str(lost), "0", lost)
    row("frames unaccounted for", str(received - sum(accounted)), "0", abs(received - sum(accounted)))
    p50, p99 = latency_ms(fields)
    row("frame popped -> message received in another process, p50", f"{p50:.3f} ms", "<= 1 ms", p50)
    row("                                                     p99", f"{p99:.3f} ms", "<= 2 ms", p99)
    resident, peak = memory
    row("resident memory of the daemon, one press", f"{resident:.0f} MB", "<= 130 MB", resident)
    row("    at most, while the zero's solver was made", f"{peak:.0f} MB")
    row("processor time of the daemon, one press", f"{100 * cpu:.1f} % of a core", "<= 50 %", cpu)
    under_load("one press", fields, truth)


def stages():
    def medians(program, pattern):
        report = json.loads(run(rig.BIN / program, "--benchmark_format=json", "--benchmark_repetitions=9",
                                f"--benchmark_filter={pattern}", "--benchmark_min_time=0.2"))
        return {entry["run_name"]: entry["real_time"] for entry in report["benchmarks"]
                if entry.get("aggregate_name") == "median"}

    for name, value in medians("track_bench", "rgb8|Press").items():
        row(f"tracking one frame, one thread, median ({name})", f"{value:.3f} ms", "<= 0.20 ms" if "rgb8" in name else "", value)
    for name, value in medians("solve_bench", "solve(InCache|Flushed)").items():
        flushed = "Flushed" in name
        row(f"solving one frame, one thread, median{', cache flushed between frames' if flushed else ''}", f"{value:.3f} ms",
            "" if flushed else "<= 1.5 ms", value)
    for _, value in medians("solve_bench", "^creep$").items():
        row("creep of five terms, of a frame with one contact", f"{value:.3f} ms", "<= 0.05 ms", value)
    report = json.loads(run(rig.BIN / "solve_bench", "--benchmark_format=json", "--benchmark_min_time=1",
                            "--benchmark_filter=solveFullFace"))["benchmarks"][0]
    row("solving a contact of the whole face, 10 % changing markers missing, p99", f"{report['p99_ms']:.3f} ms",
        "<= 30 ms", report["p99_ms"])


def throughput():
    result = json.loads(run(rig.BIN / "throughput", rig.cache_directory()))
    row("highest rate, 256 pictures in memory, one subscriber", f"{result['rate_hz']:.0f} frames/s", ">= 1500", result["rate_hz"])
    row(f"    of {result['frames']} frames lost", str(result["lost"]), "0", result["lost"])


def python_reader():
    result = json.loads(run("/usr/bin/python3", rig.SOURCE / "tests" / "bench" / "python_reader.py"))
    row(f"fields of {result['bytes']} bytes into NumPy, one core", f"{result['rate_hz']:.0f} fields/s",
        ">= 5000", result["rate_hz"])


def starts():
    with rig.Rig() as bench:
        state = bench.folder / "cold"
        state.mkdir()
        begin = time.monotonic()
        daemon = bench.start(rig.BIN / "tractiond", "--state", state, "--runtime", bench.folder / "run")
        daemon.wait_for("running: ", 120)
        seconds, memory = time.monotonic() - begin, memory_mb(daemon.child.pid)[1]
        row("a new block's influence matrix and factors: time", f"{seconds:.1f} s", "<= 3 s", seconds)
        row("    memory", f"{memory:.0f} MB", "<= 1000 MB", memory)
        daemon.stop()

        twin = bench.twin("idle")
        first = bench.daemon()
        bench.subscribe(first).collect(1)
        first.stop()
        times = []
        for _ in range(3):
            time.sleep(0.5)
            begin = time.monotonic_ns()
            again = bench.daemon(ready=False)
            field = bench.subscribe(again).collect(1)[0]
            times.append((field.header.sent_ns - begin) * 1e-9)
            again.stop()
        twin.stop()
        row("start to first field with a warm cache", f"{statistics.median(times):.2f} s", "<= 1.5 s", statistics.median(times))


def main():
    seconds = 10 if "--quick" in sys.argv[1:] else 60
    starts()
    sixty_frames_per_second(seconds)
    fewer_models(seconds)
    loads()
    touch()
    fast_cameras()
    stages()
    throughput()
    python_reader()


if __name__ == "__main__":
    main()

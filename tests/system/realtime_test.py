"""Real time by the configuration: which threads run how is read from the kernel, and held against what is published."""

import os
import pathlib
import re
import subprocess

from prometheus_client import parser

import freezer
import rig
import seed
import steady

FRAME_PATH = ["ZMQbg/IO/0", "arv_gv_stream", "tr-capture", "tr-publish", "tr-solve", "tr-track"]
FIFO, OTHER = 1, 0


def scheduling(pid):
    """(name, policy, priority, processors) of each thread, by the kernel."""
    for tid, name in freezer.threads(pid).items():
        yield name, os.sched_getscheduler(tid), os.sched_getparam(tid).sched_priority, os.sched_getaffinity(tid)


def processors(text):
    """Of the kernel's list format, "0-2,5"."""
    ranges = [item.split("-") for item in text.split(",")]
    return {cpu for ends in ranges for cpu in range(int(ends[0]), int(ends[-1]) + 1)}


def locked(pid):
    """[bytes]"""
    return 1024 * int(re.search(r"VmLck:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1])


def grants(*limits):
    """Whether this machine's kernel lets us, with these limits: real time, locked memory."""
    def may(*command):
        return subprocess.run(["prlimit", *limits, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    lock = "import ctypes, sys; sys.exit(ctypes.CDLL(None).mlockall(7) != 0)"
    return may("chrt", "--fifo", "1", "true"), may("/usr/bin/python3", "-c", lock)


class RealTime(steady.TestCase):
    def setUp(self):
        super().setUp()
        self.bench.twin("idle", truth=False)

    def status(self, daemon, after=2):
        """One of a time when the camera streams."""
        subscriber = self.bench.subscribe(daemon)
        subscriber.collect(10)
        return subscriber.collect(after, kind="status")[-1]

    def check(self, daemon, priority, cpus):
        """The published threads are those of the frame path, no others, and what is said of them is true. The status."""
        status = self.status(daemon)
        told = sorted((one.name, one.priority, tuple(sorted(processors(one.cpus)))) for one in status.scheduling.threads)
        self.assertEqual([name for name, *_ in told], FRAME_PATH)
        true = list(scheduling(daemon.child.pid))
        for one in told:
            self.assertIn(one, [(name, at, tuple(sorted(where))) for name, _, at, where in true])
        others = [(name, policy, where) for name, policy, at, where in true]
        for one in told:
            others.remove((one[0], FIFO | os.SCHED_RESET_ON_FORK if one[1] else OTHER, set(one[2])))
        for name, policy, where in others:
            self.assertEqual(policy & ~os.SCHED_RESET_ON_FORK, OTHER, name)
            self.assertEqual(where, os.sched_getaffinity(0), name)
        for name, at, where in told:
            self.assertEqual(at, max(priority - 1, min(priority, 1)) if name.startswith("ZMQ") else priority, name)
            self.assertEqual(set(where), cpus, name)
        self.assertEqual(status.scheduling.locked_bytes, locked(daemon.child.pid))
        return status

    def test_what_is_asked_for_is_shown_as_it_was_granted(self):
        draw = seed.chance(self.id())
        priority, cpu = draw.randint(1, 98), draw.choice(sorted(os.sched_getaffinity(0)))
        time, memory = grants()
        print(f"\n  priority {priority} on {cpu}; granted here: real time {time}, locked memory {memory} ", end="", flush=True)
        memory = memory and rig.PATIENCE == 1  # sanitizers pass mlockall() over
        daemon = self.bench.daemon(f'[realtime]\npriority = {priority}\ncpus = "{cpu}"\nlock_memory = true\n')
        status = self.check(daemon, priority if time else 0, {cpu})
        self.assertEqual(status.scheduling.locked_bytes > 0, memory)
        line = daemon.wait_for("real time: ")
        for name in set(FRAME_PATH) - {"arv_gv_stream"}:  # which may come later
            self.assertIn(name, line)
        self.assertEqual("realtime.priority = " in daemon.output(), not time, daemon.output())
        self.assertEqual("realtime.lock_memory is not granted" in daemon.output(), not memory, daemon.output())
        self.assertNotIn("realtime.cpus", daemon.output())

        code, text = self.ctl(daemon, "status")
        self.assertEqual(code, 0, text)
        self.assertEqual(f"on {cpu}" in text and "real time " in text, True, text)
        self.assertEqual("not granted" in text, not (time and memory), text)
        code, text = self.ctl(daemon, "metrics")
        families = {family.name: family for family in parser.text_string_to_metric_families(text)}
        samples = families["traction_realtime_priority"].samples
        self.assertEqual(sorted(sample.labels["thread"] for sample in samples), FRAME_PATH)
        self.assertEqual({sample.labels["cpus"] for sample in samples}, {str(cpu)})
        self.assertEqual(daemon.stop(), 0, daemon.output())

    def test_what_is_refused_is_named_and_the_daemon_goes_on(self):
        limits = ("--rtprio=0:0", "--memlock=8388608:8388608")
        without = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", "--inh-caps=-sys_nice,-ipc_lock"]
        asked = '[realtime]\npriority = 20\ncpus = "1023"\nlock_memory = true\n'
        daemon = self.bench.daemon(asked, before=["prlimit", *limits, *without])
        status = self.check(daemon, 0, os.sched_getaffinity(0))
        self.assertEqual(status.scheduling.locked_bytes, 0)
        self.assertEqual((status.scheduling.asked_priority, status.scheduling.asked_cpus, status.scheduling.asked_lock),
                         (20, "1023", True))
        for line in ("realtime.priority = 20 is not granted: Operation not permitted; .*LimitRTPRIO=20 and RestrictRealtime=no",
                     'realtime.cpus = "1023" is not granted: Invalid argument: it runs on ',
                     "realtime.lock_memory is not granted: .*LimitMEMLOCK=infinity"):
            daemon.wait_for("warning: " + line)
        code, text = self.ctl(daemon, "status")
        self.assertRegex(text, "not granted: priority 20, processors 1023, memory")
        code, text = self.ctl(daemon, "top", "--once")
        self.assertRegex(text, "! .*real time is not granted: priority 20, processors 1023, memory")
        self.assertEqual(daemon.stop(), 0, daemon.output())

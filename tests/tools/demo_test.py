"""tools/demo: what it does before it does anything, how it ends, and that it leaves nothing behind.

With programs that stand in for those of the build, except where a picture has to be seen. Whatever opens a camera does so
in a network namespace made here.
"""

import os
import pathlib
import signal
import subprocess
import time
import unittest

from stubs import TOOLS, Stubs

BIN = pathlib.Path(os.environ["TRACTION_BUILD"], "bin")
DEMO = TOOLS / "demo"
OWN_NETWORK = ("unshare", "--user", "--map-root-user", "--net")
READY = "sleep {seconds}; echo {word}; exec sleep 1000"


def processes_with(text):
    """Of all processes that are alive, those in whose command line the text occurs."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                line = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            except OSError:
                continue
            if text in line and int(entry.name) != os.getpid():
                found.append(line)
    return found


class Demo(unittest.TestCase):
    def setUp(self):
        self.stubs = Stubs(self)
        self.programs = self.stubs.folder / "programs"

    def stand_in(self, twin=READY.format(seconds=0, word="ready"), daemon=READY.format(seconds=0, word="running"),
                 ctl="exit 0"):
        for name, script in (("traction-twin", twin), ("tractiond", daemon), ("tractionctl", ctl)):
            self.stubs.add(name, script, self.programs)

    def demo(self, *words, programs=None, network=OWN_NETWORK, **options):
        return self.stubs.run(*network, DEMO, "--programs", programs or self.programs, *words, **options)

    def tearDown(self):
        self.assertEqual(os.listdir(self.stubs.scratch), [])
        deadline = time.monotonic() + 10
        while (left := processes_with(str(self.stubs.folder))) and time.monotonic() < deadline:
            time.sleep(0.1)
        self.assertEqual(left, [])

    # Before anything is done.

    def forbid(self):
        for name in ("apt-get", "sudo", "cmake", "ninja", "unshare"):
            self.stubs.add(name)

    def test_wrong_words_end_it_at_once(self):
        self.forbid()
        for words, expected in ((["--fast"], 64), (["--seconds", "x"], 64), (["--seconds"], 64), (["--seconds", "-1"], 64),
                                (["no_such_scenario"], 66), (["/no/such.toml"], 66)):
            code, text = self.stubs.run(DEMO, *words)
            self.assertEqual(code, expected, text)
            self.assertIn(words[-1], text)
        self.assertEqual(self.stubs.called(), "")

    # How it ends.

    def test_what_does_not_start_ends_it_with_its_exit_code_and_reason(self):
        for name, word in (("twin", "traction-twin"), ("daemon", "tractiond")):
            for code in (1, 69, 78):
                self.stand_in(**{name: f"echo {word}: a reason of its own; sleep 1; exit {code}"})
                ended, text = self.demo("--seconds", "3")
                self.assertEqual(ended, code, text)
                self.assertIn("a reason of its own", text)

    def test_what_ends_during_the_view_ends_it(self):
        for name, word in (("twin", "ready"), ("daemon", "running")):
            self.stand_in(ctl='[ "$1" = echo ] || exec sleep 1000',
                          **{name: f"echo {word}; sleep 2; echo out of the blue; exit 9"})
            ended, text = self.demo()
            self.assertEqual(ended, 9, text)
            self.assertIn("out of the blue", text)

    def test_no_field_is_a_failure(self):
        self.stand_in()
        ended, text = self.demo("--seconds", "1")
        self.assertEqual(ended, 69, text)
        self.assertIn("no field was measured", text)
        self.assertNotIn("Killed", text)  # bash's own words of what the end ends

    def begins_a_view_and_gets(self, end):
        self.stand_in(ctl='[ "$1" = echo ] && exec sleep 1000; echo in sight; exec sleep 1000')
        with subprocess.Popen([*OWN_NETWORK, DEMO, "--programs", self.programs], env=self.stubs.env,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              start_new_session=True) as demo:
            self.assertEqual(demo.stdout.readline(), b"in sight\n")
            demo.send_signal(end)
        deadline = time.monotonic() + 20
        while os.listdir(self.stubs.scratch) and time.monotonic() < deadline:
            time.sleep(0.1)
        self.tearDown()

    def test_killed_without_warning_it_takes_everything_with_it(self):
        for end in (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP):
            self.begins_a_view_and_gets(end)

    # What it keeps.

    def test_the_record_stays_small(self):
        sizes = []
        with subprocess.Popen([*OWN_NETWORK, DEMO, "--programs", BIN, "--seconds", "12"], env=self.stubs.env,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True) as demo:
            lines = []
            for line in demo.stdout:
                lines.append(line)
                sizes.append(sum(file.stat().st_size for file in self.stubs.scratch.rglob("*")
                                 if file.is_file() and ".factors" not in file.name))  # or one that is being written
        self.assertEqual(demo.returncode, 0, "".join(lines))
        self.assertIn("Force on the gel", "".join(lines))
        self.assertLess(max(sizes), 1 << 20)
        view = [size for size, line in zip(sizes, lines) if "lost" in line]
        self.assertLess(view[-1] - view[len(view) // 2], 1 << 16)


if __name__ == "__main__":
    unittest.main()

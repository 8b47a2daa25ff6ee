"""tools/demo shows forces, and its record of them stays small. Opens its camera in a network namespace made here."""

import contextlib
import os
import pathlib
import subprocess
import tempfile
import unittest

from scripts import TOOLS

BIN = pathlib.Path(os.environ["TRACTION_BUILD"], "bin")


class Demo(unittest.TestCase):
    def test_shows_forces_and_leaves_nothing_behind(self):
        scratch = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-demo-")))
        lines, sizes = [], []
        with subprocess.Popen(["unshare", "--user", "--map-root-user", "--net", TOOLS / "demo", "--programs", BIN, "--seconds", "12"],
                              env={**os.environ, "TMPDIR": str(scratch)}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True) as demo:
            for line in demo.stdout:
                lines.append(line)
                sizes.append(sum(file.stat().st_size for file in scratch.rglob("*")
                                 if file.is_file() and ".factors" not in file.name))  # or one that is being written
        self.assertEqual(demo.returncode, 0, "".join(lines))
        self.assertIn("Force on the gel", "".join(lines))
        self.assertLess(max(sizes), 1 << 20)
        view = [size for size, line in zip(sizes, lines) if "lost" in line]
        self.assertLess(view[-1] - view[len(view) // 2], 1 << 16)
        self.assertEqual(os.listdir(scratch), [])
        for process in pathlib.Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):  # it has ended, or is another user's
                self.assertNotIn(os.fsencode(scratch) + b"/traction-demo.", process.read_bytes(), process)

"""traction-lens as a person runs it: what it says to wrong commands. What the commands compute: calibrate_command_test.cpp and
gel_picture_*_test.cpp.
"""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

BIN = pathlib.Path(os.environ["TRACTION_BUILD"]) / "bin"


def run(*arguments, cwd=None):
    return subprocess.run([BIN / "traction-lens", *arguments], capture_output=True, text=True, cwd=cwd, timeout=120)


class CommandLine(unittest.TestCase):
    def check(self, arguments, code, words):
        done = run(*arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1)
        self.assertTrue(lines[0].startswith("traction-lens: "), lines[0])
        self.assertIn(words, lines[0])

    def test_what_is_wrong_is_said(self):
        self.check([], 64, "a command is needed")
        self.check(["nonsense"], 64, "nonsense")
        self.check(["calibrate", "a.png", "--square-mm", "10", "--output", "o"], 64, "--squares")
        for squares in ("9", "9x", "x6", "9x6x", "3x6", "-9x6", "999999x6"):
            self.check(["calibrate", "a.png", "--squares=" + squares, "--square-mm", "10", "--output", "o"], 64,
                       "--squares is to be two numbers")
        self.check(["calibrate", "no.png", "--squares", "9x6", "--square-mm", "10", "--output", "o"], 66, "no.png")
        self.check(["calibrate", "no.png", "--squares", "9x6", "--square-mm", "10.2x10", "--output", "o"], 66, "no.png")
        self.check(["calibrate", "no.png", "--squares", "6x6", "--square-mm", "10.2x10", "--output", "o"], 64, "oblong")
        for side in ("x", "10x", "10y10", "0", "-1", "nan", "10x10x10", "10x0.01", "1e9"):
            self.check(["calibrate", "a.png", "--squares=9x6", "--square-mm=" + side, "--output", "o"], 64,
                       "--square-mm is to be one or two lengths")
        self.check(["pose", "no.png", "--gel", "no.toml", "--output", "o"], 66, "no.toml")
        self.check(["sheet", "--output-dir", "/proc/none"], 73, "/proc/none/layer1.svg")

    def test_programs_read_one_object(self):
        with tempfile.TemporaryDirectory() as folder:
            done = run("sheet", "--json", cwd=folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            report = json.loads(done.stdout)
            self.assertEqual((report["figures"], report["faults"]), ([], []))
            self.assertIn("print them without fitting", report["notes"][0])
        done = run("--json", "board", "no\x1b.png", "--squares", "9x6")
        self.assertEqual(done.returncode, 66)
        self.assertIn("no\x1b.png", json.loads(done.stdout)["faults"][0])

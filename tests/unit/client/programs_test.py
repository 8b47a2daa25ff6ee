"""All programs understand --help alike, and tell a word that they do not understand."""

import os
import pathlib
import subprocess
import unittest

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
PROGRAMS = ["tractiond", "tractionctl", "traction-gateway", "traction-touch", "traction-input", "traction-twin", "traction-lens",
            "traction-gel"]
if (BUILD / "bin" / "traction-view").exists():  # which a machine that npm does not reach cannot build
    PROGRAMS.append("traction-view")
USAGE = 64


def run(program, *words, **options):
    done = subprocess.run([program, *words], stdin=subprocess.DEVNULL, text=True, timeout=120,
                          **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options})
    return done.returncode, done.stdout, done.stderr


class Programs(unittest.TestCase):
    def helps(self, program):
        code, out, err = run(program, "--help")
        self.assertEqual((code, err), (0, ""), program)
        self.assertIn(program.name, out)
        for words in (["--nonsense"], ["--nonsense", "word"]):
            code, out, err = run(program, *words)
            self.assertEqual((code, out), (USAGE, ""), f"{program} {words}: {err}")
            self.assertRegex(err, rf"\A{program.name}: [^\n]*see {program.name} --help\n\Z")

    def test_programs(self):
        for name in PROGRAMS:
            with self.subTest(name):
                self.helps(BUILD / "bin" / name)
                code, out, err = run(BUILD / "bin" / name, "--version")
                self.assertEqual((code, err), (0, ""))
                self.assertRegex(out, rf"\A{name} \d+\.\d+\.\d+\n\Z")

    def test_a_number_outside_its_range_is_refused(self):
        for program, option, least, most in (
                ("traction-twin", "--rate", "1", "1000"), ("traction-twin", "--lost-ratio", "0", "1"),
                ("traction-twin", "--seconds", "0", "1e+09"), ("tractiond", "--record-hz", "0", "1e+06"),
                ("tractiond", "--replay-rate", "0", "1e+06")):
            for text in ("nan", "-1", "1e999", "1x"):
                with self.subTest(f"{program} {option}={text}"):
                    code, out, err = run(BUILD / "bin" / program, f"{option}={text}")
                    said = f"{program}: {option}: '{text}' is not a number from {least} to {most}; see {program} --help\n"
                    self.assertEqual((code, out, err), (USAGE, "", said))

"""tools/nightly runs each part once for a commit, whatever becomes of the others, and goes on where it was interrupted."""

import shutil
import signal
import subprocess
import time
import unittest

from scripts import TOOLS, Scratch

PARTS = """fails echo it is broken; exit 3
waits [ ! -e patient ] || { touch waiting; sleep 60; }; echo done
mutations-1 printf ' 1 base/a.h:3 killed by A\\n 2 base/b.h:4 SURVIVED\\n       - old\\n       + new\\n'
counts echo once >>count
"""


class Nightly(unittest.TestCase):
    def setUp(self):
        self.scratch = Scratch(self)
        self.tree = self.scratch.folder / "tree"
        (self.tree / "tools").mkdir(parents=True)
        shutil.copy(TOOLS / "nightly", self.tree / "tools")
        (self.tree / ".gitignore").write_text("*\n!.gitignore\n")
        (self.scratch.folder / "parts").write_text(PARTS)
        self.git("init", "--quiet")
        self.commit("first")

    def git(self, *words):
        subprocess.run(["git", "-C", self.tree, "-c", "user.name=n", "-c", "user.email=n@n", *words], check=True)

    def commit(self, subject):
        self.git("add", "--force", ".gitignore", "tools/nightly")
        self.git("commit", "--quiet", "--allow-empty", "-m", subject)

    def command(self, *words):
        return [self.tree / "tools/nightly", "--parts", self.scratch.folder / "parts", *words]

    def report(self):
        return (self.tree / "build/nightly/report.md").read_text()

    def test_goes_on_after_a_failure_and_an_interruption(self):
        (self.tree / "patient").touch()
        with subprocess.Popen(self.command(), stdout=subprocess.DEVNULL, start_new_session=True) as night:
            while not (self.tree / "waiting").exists():
                self.assertIsNone(night.poll())
                time.sleep(0.01)
            night.send_signal(signal.SIGTERM)
        subprocess.run(["pkill", "-TERM", "--session", str(night.pid)])
        (self.tree / "patient").unlink()
        code, said = self.scratch.run(*self.command())
        self.assertEqual(code, 8, said)
        self.assertNotIn("it is broken", said)
        self.assertNotIn("nightly: fails: echo", said)  # ran before the interruption
        report = self.report()
        for line in ("| fails | FAILED with 3 | 0 |", "| waits | passed | 0 |", "| counts | passed | 0 |", "it is broken",
                     "1 of 2 killed; survivors:\n```\nbase/b.h:4\n       - old\n       + new\n```"):
            self.assertIn(line, report)
        self.assertEqual(self.scratch.run(*self.command())[0], 8)
        self.assertEqual((self.tree / "count").read_text(), "once\n")
        # By name a part runs again; another commit begins anew.
        self.scratch.run(*self.command("counts"))
        self.commit("second")
        self.scratch.run(*self.command("counts"))
        self.assertEqual((self.tree / "count").read_text(), "once\n" * 3)
        self.assertIn("| fails | not run | |", self.report())

    def test_what_is_wrong_is_said(self):
        code, said = self.scratch.run(*self.command("nonsense"))
        self.assertEqual(code, 64)
        self.assertIn("no part is called 'nonsense'", said)
        with open(self.tree / ".gitignore", "a") as file:
            file.write("# changed\n")
        code, said = self.scratch.run(*self.command())
        self.assertEqual(code, 65)
        self.assertIn("not committed", said)

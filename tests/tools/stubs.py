"""Programs that stand in for others, first in the PATH of a script of tools/."""

import os
import pathlib
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TOOLS = SOURCE / "tools"


class Stubs:
    """A folder of small scripts, each of which notes in `called` that it was called."""

    def __init__(self, test):
        self.folder = pathlib.Path(test.enterContext(tempfile.TemporaryDirectory(prefix="traction-stubs-")))
        self.log = self.folder / "called"
        self.scratch = self.folder / "tmp"
        self.scratch.mkdir()
        self.env = {**os.environ, "PATH": f"{self.folder}:{os.environ['PATH']}", "TMPDIR": str(self.scratch)}

    def add(self, name, script="exit 1", folder=None):
        path = (folder or self.folder) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\necho \"{name} $*\" >>{self.log}\n{script}\n")
        path.chmod(0o755)

    def called(self):
        return self.log.read_text() if self.log.exists() else ""

    def run(self, *command, timeout=120, **options):
        """Exit code and everything printed."""
        done = subprocess.run([str(word) for word in command], env=self.env, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True, timeout=timeout, **options)
        return done.returncode, done.stdout

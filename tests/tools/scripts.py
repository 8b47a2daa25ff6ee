"""Where the scripts of tools/ are, and how a test runs one."""

import os
import pathlib
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TOOLS = SOURCE / "tools"


class Scratch:
    """A folder for a script of tools/ and what it writes."""

    def __init__(self, test):
        self.folder = pathlib.Path(test.enterContext(tempfile.TemporaryDirectory(prefix="traction-tools-")))
        self.scratch = self.folder / "tmp"
        self.scratch.mkdir()
        self.env = {**os.environ, "TMPDIR": str(self.scratch)}

    def run(self, *command, timeout=120, **options):
        """Exit code and everything printed."""
        done = subprocess.run([str(word) for word in command], env=self.env, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True, timeout=timeout, **options)
        return done.returncode, done.stdout

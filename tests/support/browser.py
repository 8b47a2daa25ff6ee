"""traction-view, and its page in Chromium, for tests and benchmarks."""

import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import time

import seed
from rig import BIN, BUILD, PATIENCE, Rig

DRIVER = pathlib.Path(__file__).resolve().parent / "browser.mjs"
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Browser:
    """The page in Chromium, without a window."""

    def __init__(self, rig, url, width=1400, height=900):
        # It writes into its folder until it is gone.
        folder = rig.enter_context(tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True))
        self.child = subprocess.Popen(
            ["node", DRIVER, BUILD, CHROMIUM, folder, url, str(width), str(height)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        rig.callback(self.end)
        assert json.loads(self.child.stdout.readline()) == {"ready": True}

    def end(self):
        self.child.kill()  # Chromium goes with it
        self.child.communicate()

    def ask(self, **task):
        self.child.stdin.write(json.dumps(task) + "\n")
        self.child.stdin.flush()
        told = json.loads(self.child.stdout.readline())
        if "error" in told:
            raise AssertionError(told["error"])
        return told.get("value")

    def evaluate(self, expression):
        return self.ask(evaluate=expression)

    def wait_for(self, expression, seconds=60):
        deadline = time.monotonic() + seconds * PATIENCE
        while not (value := self.evaluate(f"Boolean({expression})")):
            if time.monotonic() > deadline:
                raise AssertionError(f"{expression} is still {value!r}; {self.ask(requests=True)}")
            time.sleep(0.2)
        return value


def start_view(rig, daemon, *options, **process):
    """traction-view: with a daemon, or as the options say."""
    endpoints = [] if daemon is None else ["--connect", daemon.endpoint["stream"], "--control", daemon.endpoint["control"]]
    listen = [] if "--listen" in options else ["--listen", "0"]
    process = rig.start(BIN / "traction-view", *endpoints, *listen, *options, **process)
    process.url = re.search(r"http\S+/", process.wait_for("http"))[0]
    process.port = int(process.url.rsplit(":", 1)[1].rstrip("/"))
    return process


class TestCase(seed.TestCase):
    def setUp(self):
        if not (BIN / "traction-view").exists():
            self.skipTest("traction-view is not built: Node, npm or Boost's headers are missing")
        self.rig = self.enterContext(Rig())

    def view(self, daemon, *options, **process):
        return start_view(self.rig, daemon, *options, **process)

    def browser(self, view, **size):
        if CHROMIUM is None:
            print("\n  there is no Chromium here: what is seen in a browser is not tested")
            self.skipTest("no Chromium")
        return Browser(self.rig, view.url, **size)

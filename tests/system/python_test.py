"""The Python client and its examples with a real daemon: the README's words are run as they stand there."""

import importlib.util
import json
import pathlib
import re
import signal
import sys
import time
import unittest


CLIENT = pathlib.Path(__file__).resolve().parents[2] / "client" / "python"
EXAMPLES = CLIENT.parent / "examples" / "python"
sys.path.insert(0, str(CLIENT))
import rig  # noqa: E402
import steady  # noqa: E402
import traction  # noqa: E402

HAS_MATPLOTLIB = importlib.util.find_spec("matplotlib") is not None


def drawing(bench):
    """A screen is not here."""
    return {"MPLBACKEND": "Agg", "MPLCONFIGDIR": str(bench.folder)}


def python(bench, *words, env=None):
    """Starts Python with the client, which finds the instance `default` of the rig in its runtime directory."""
    sockets = bench.folder / "session" / "tractiond" / "default"
    if not sockets.exists():
        sockets.parent.mkdir(parents=True)
        sockets.symlink_to(bench.folder / "default" / "run")
    path = {"PYTHONPATH": str(CLIENT), "XDG_RUNTIME_DIR": str(bench.folder / "session")}
    return bench.start(sys.executable, "-u", *words, env={**path, **(env or {})})


class Python(steady.TestCase):
    def setUp(self):
        super().setUp()
        self.twin = self.bench.twin("hold", truth=False)
        self.daemon = self.bench.daemon()
        next(traction.fields(endpoint=self.daemon.endpoint["stream"], timeout=60 * rig.PATIENCE))  # there is a zero

    def subscriber(self, **options):
        return self.enterContext(traction.Subscriber(endpoint=self.daemon.endpoint["stream"], **options))

    def test_the_readmes_five_lines_show_a_field(self):
        snippet = re.search(r"```python\n(.*?)```", (rig.SOURCE / "README.md").read_text(), re.S)[1]
        self.assertLessEqual(len([line for line in snippet.splitlines() if line.strip()]), 5)
        begin = time.monotonic()
        child = python(self.bench, "-c", snippet)
        child.wait_for(r"^\[.*\] \(576, 3\)$")
        print(f"\n  first field {time.monotonic() - begin:.2f} s after the start of Python", flush=True)

    def test_force_meter(self):
        child = python(self.bench, EXAMPLES / "force_meter.py")
        child.wait_for(r"x +[+-]\d+[.]\d{3} ± \d+[.]\d{3} N +y .* z .* N")
        child.stop(signal.SIGINT)

    def test_hold_force_stops_when_the_daemon_is_gone(self):
        for message in self.subscriber(timeout=60 * rig.PATIENCE):
            sound = message.header.flags <= traction.Flag.ZERO_UNVERIFIED
            if sound and isinstance(message, traction.Field) and message.valid:
                break
        child = python(self.bench, EXAMPLES / "hold_force.py", "2.0")
        child.wait_for(r"^move [+-]\d[.]\d{3} mm/s$|stale|lost|flagged")  # a busy machine is late, and that stops it, too
        self.daemon.stop(signal.SIGKILL)
        self.assertEqual(child.join(), 1, child.output())
        self.assertEqual(child.lines[-2], "stop")
        self.assertRegex(child.lines[-1], "^hold_force: (stale|lost|flagged)")

    @unittest.skipUnless(HAS_MATPLOTLIB, "matplotlib is not here")
    def test_quiver(self):
        picture = self.bench.folder / "field.png"
        child = python(self.bench, "-W", "error::RuntimeWarning", EXAMPLES / "quiver.py", picture, env=drawing(self.bench))
        self.assertEqual(child.join(60), 0, child.output())
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")

    @unittest.skipUnless(HAS_MATPLOTLIB, "matplotlib is not here")
    def test_notebook(self):
        cells = json.loads((EXAMPLES / "traction.ipynb").read_text())["cells"]
        self.assertFalse(any(cell.get("outputs") for cell in cells))
        program = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        child = python(self.bench, "-c", program, env=drawing(self.bench))
        self.assertEqual(child.join(60), 0, child.output())

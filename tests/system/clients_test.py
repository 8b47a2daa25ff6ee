"""What a person at a shell is told while cameras and daemons come and go."""

import json
import signal

import rig
import steady

NO_CAMERA, UNAVAILABLE = 66, 69


class Clients(steady.TestCase):
    def test_old_numbers_are_not_shown_as_new_ones(self):
        twin = self.bench.twin("hold", truth=False)
        daemon = self.bench.daemon()
        control = ["--control", daemon.endpoint["control"]]
        watch = self.bench.start(rig.BIN / "tractionctl", "watch", "--connect", daemon.endpoint["stream"])
        watch.wait_for(r"force [+-]", 60)
        top = self.bench.start(rig.BIN / "tractionctl", "top", daemon.endpoint["stream"])
        top.wait_for(r"  camera streaming, up .* force [+-].* markers 1152/1152 ", 60)
        self.bench.subscribe(daemon).collect(2, "status")  # it is told once a second: the next is of when fields came
        code, out = self.bench.ctl("status", *control)
        self.assertEqual(code, 0, out)

        twin.kill()
        watch.forget()  # a machine that stood still has lines without a field, too
        top.forget()
        watch.wait_for(r"no force: no field for 0[.]\d s")
        watch.wait_for("no force: the camera is lost.*, no field for")
        top.wait_for(r"  camera lost, up .* force \([+-].*! the camera is lost.*, no field for")
        code, out = self.bench.ctl("status", *control)
        self.assertEqual(code, NO_CAMERA, out)
        self.assertIn("camera lost", out)
        code, out = self.bench.ctl("status", "--json", *control)
        self.assertEqual(code, NO_CAMERA, out)
        self.assertIn("lost", [json.loads(line)["camera"] for line in out.splitlines() if line.startswith("{")])

        daemon.stop(signal.SIGKILL)
        watch.wait_for("no force: tractiond is gone, no field for")
        top.wait_for(r"  \(camera lost, up .* force \([+-].* markers \(.*! tractiond is gone, no field for")
        code, out = self.bench.ctl("status", *control)
        self.assertEqual(code, UNAVAILABLE, out)

        daemon = self.bench.daemon(state=daemon.state)
        watch.wait_for("no force: tractiond was restarted: ")
        self.bench.twin("hold", truth=False)
        watch.wait_for("force .*! tractiond restarted", 60)
        top.wait_for(r"  camera streaming, up \d[^:]* force [+-].*zero")
        self.assertEqual(top.stop(signal.SIGINT), 0, top.output())
        self.assertEqual(watch.stop(signal.SIGINT), 0, watch.output())
        first, restarted = (watch.lines.index(watch.wait_for(text)) for text in ("no force: no field", "was restarted"))
        for line in watch.lines[first:restarted]:
            self.assertIn("no force", line)

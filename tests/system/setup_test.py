"""traction-view --setup: from a camera without a gel file to a daemon that measures with a calibrated one."""

import json
import re
import socket
import time
import unittest
import urllib.error
import urllib.request

import numpy as np

import projector
import rig
import seed
from browser import TestCase
from calibrate_test import GEL, HIDDEN
from deadline import HUNG_S
from websocket import RawWebSocket

LAYER = {"colour": "blue", "contrast": "brighter", "columns": 24, "rows": 24, "pitch_mm": 3, "depth_mm": 6,
         "diameter_mm": 0.6, "x_mm": 0, "y_mm": 0}
FORM = {"width_mm": 100, "height_mm": 100, "thickness_mm": 40, "youngs_modulus_kpa": 180, "poisson_ratio": 0.49,
        "gel_index": 1, "window": "none", "window_mm": 0, "distance_mm": 140, "marker_depth_mm": 0, "marker_place_mm": 0,
        "lens_mm": 5.376, "pixel_um": 5.6, "width_px": 640, "height_px": 480,
        "layers": [LAYER, LAYER | {"colour": "red", "depth_mm": 8, "x_mm": 1.5, "y_mm": 1.5}]}
WEIGHTS_GF = (100, 200, 500)
RECOVERING = 1024  # FLAG_RECOVERING
ADOPTED = '[sensor]\ngel_file = "adopted"\n'


def chessboard(tilt, turn, place_mm):
    """A picture of 10 x 7 squares of 10 mm, 180 mm before a lens of 960 px; three by three rays a pixel."""
    (a, b), offsets = tilt, (-1 / 3, 0, 1 / 3)
    rotation = (np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]) @
                np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]]) @
                np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]]))
    centre = np.array([*place_mm, 180.0])
    picture = np.zeros((480, 640))
    for du in offsets:
        for dv in offsets:
            v, u = np.mgrid[0:480, 0:640]
            rays = np.stack([(u + du - 319.5) / 960, (v + dv - 239.5) / 960, np.ones_like(u, float)], axis=-1)
            distance = (rotation[:, 2] @ centre) / (rays @ rotation[:, 2])
            x, y = np.moveaxis((rays * distance[..., None] - centre) @ rotation[:, :2], -1, 0)
            dark = (np.floor(x / 10 + 5) + np.floor(y / 10 + 3.5)) % 2 == 0
            picture += np.where((abs(x) < 50) & (abs(y) < 35), np.where(dark, 40, 200), np.where((abs(x) < 60) & (abs(y) < 45), 200, 110)) / 9
    return picture


class OtherCamera(rig.TestCase):
    def test_another_camera_or_cut_is_refused_by_name(self):
        """Two twins, whose serial numbers are their addresses."""
        one, other = (f"Traction-127-0-0-{n} (640 x 480 px" for n in (1, 2))
        self.bench.twin("idle", truth=False)
        self.bench.twin("idle", address="127.0.0.2", truth=False)
        gel = self.bench.folder / "gel.toml"
        bound = f'[sensor]\ngel_file = "{gel}"\n'
        binned = 'features = [{ BinningVertical = 2 }]\n'

        def ends(code, words, *config, **options):
            daemon = self.bench.daemon(*config, ready=False, **options)
            self.assertEqual(daemon.join(), code, daemon.output())
            self.assertIn(words, daemon.output())

        def pose(file, output):
            lens = self.bench.start(rig.BIN / "traction-lens", "pose", file, "--output", output, "--gel",
                                  gel if gel.exists() else rig.SOURCE / "config/gels/paper.toml")
            return lens.join(), lens.output()

        daemon = self.bench.daemon()
        daemon.wait_for("zero taken, by itself")
        code, output = self.ctl(daemon, "snapshot", self.bench.folder / "one.png")
        self.assertEqual(code, 0, output)
        daemon.stop()
        code, output = pose(self.bench.folder / "one.png", gel)
        self.assertEqual(code, 0, output)
        self.assertIn(f'measured_with = "{one})"', gel.read_text())
        daemon = self.bench.daemon(bound)  # all is right: nothing more is asked for, and the zero is used
        daemon.wait_for("the zero is the one kept")
        daemon.stop()
        ends(65, f"the rest pose was taken with camera {one}), this is {one}, BinningVertical = 2)", binned)
        ends(78, f"measured with {one}), this is {one}, BinningVertical = 2)", binned + bound)
        ends(78, f"measured with {one}), this is {other})", bound, camera="127.0.0.2")
        seen = self.bench.daemon('[sensor]\ngel_file = "none"\n', camera="127.0.0.2")
        code, output = self.ctl(seen, "snapshot", self.bench.folder / "other.png")
        self.assertEqual(code, 0, output)
        code, output = pose(self.bench.folder / "other.png", self.bench.folder / "wrong.toml")
        self.assertEqual(code, 65, output)
        self.assertIn(f"is of {other}), the lens of {gel} was measured with {one})", output)
        print("\n  camera A's gel file, zero and lens with camera B, and with BinningVertical = 2: each refused by name; right: none used", end=" ")


class Setup(TestCase):
    def setUp(self):
        super().setUp()
        self.draw = seed.chance(self.id())
        self.number = 0

    def connect(self, view):
        self.socket = RawWebSocket(self.rig, self.draw, view.port, "/stream/0?mode=stream&topics=recorder")
        self.assertEqual(self.socket.status, 101)

    def ask(self, request=None):
        """The result of a step of the setup, or the words of its refusal."""
        self.number += 1
        self.socket.send(f"ask {self.number} setup" + (" " + json.dumps(request) if request else ""))
        while True:
            topic, content = self.socket.receive()[1].split(b"\0", 1)
            if topic == b"done/%d" % self.number:
                return json.loads(content)
            if topic == b"error/%d" % self.number:
                return content.decode()

    def step(self, **request):
        result = self.ask(request)
        self.assertIsInstance(result, (dict, list), result)
        return result

    def serve(self, pictures):
        """A camera that shows these pictures, in place of the one before."""
        if self.twin:
            self.twin.stop()
        file = self.rig.folder / "shown.raw"
        file.write_bytes(b"".join(pictures))
        self.twin = self.rig.twin("idle", "--serve", file, "--rate", 20, truth=False)

    def await_gel(self, daemon):
        """It starts again with the gel that it has adopted."""
        begin = time.monotonic()
        daemon.wait_for("starts again with the gel file that was adopted")
        daemon.forget()
        daemon.wait_for("zero taken, by itself|the zero is the one kept")
        print(f"\n  measures again after {time.monotonic() - begin:.1f} s", end=" ")
        rig.keep_factors(daemon.state)

    def test_a_camera_becomes_a_calibrated_sensor(self):
        loads = self.rig.folder / "weights.toml"
        loads.write_text(GEL + "[[contacts]]\nradius_mm = 4\nx_mm = 1.3\ny_mm = -2.1\n"
                         "time_s = [3, 3.1, 4.1, 4.2, 5.2, 5.3, 9]\nforce_z_n = "
                         f"{[0] + [gf * rig.GRAM_FORCE for gf in WEIGHTS_GF for _ in range(2)]}\n")
        rest, *loaded = projector.scenes(self.rig, loads, [(0, 0.5), (3.2, 4.0), (4.3, 5.1), (5.4, 6.3)])
        self.twin = None
        self.serve(rest)
        daemon = self.rig.daemon(ADOPTED)
        folder = self.rig.folder / "setup"
        view = self.view(daemon, "--setup", folder)
        self.connect(view)

        seen = self.step(do="look")
        print(f"\n  {seen['markers']} markers, {seen['diameter_px']:.2f} px wide, {seen['pitch_px']:.2f} px apart")
        self.assertEqual((seen["width_px"], seen["height_px"]), (640, 480))
        self.assertAlmostEqual(seen["diameter_px"], 0.6 / 0.15625, delta=0.6)
        self.assertAlmostEqual(seen["pitch_px"], 3 / 0.15625, delta=0.5)
        exposure, = self.step(do="camera", matching="exposure")["features"][:1]
        self.assertEqual(self.step(do="camera", name=exposure["name"], value="3000")["features"][0]["value"], 3000)

        self.assertIn("describe the gel first", self.ask({"do": "pose"}))
        self.assertIn("thickness_mm is to be a number from 0.5 to 500", self.ask({"do": "gel", "form": FORM | {"thickness_mm": 0}}))
        self.step(do="gel", form=FORM | {"layers": [LAYER | {"columns": 23}, FORM["layers"][1]]})
        self.assertIn("shows another gel than the gel file", self.step(do="pose")["fault"])
        self.assertIn("there is no gel.toml yet", self.ask({"do": "adopt"}))
        # A first try, whose zero the next gel cannot have.
        self.step(do="gel", form=FORM | {"layers": [layer | {"diameter_mm": 0.62} for layer in FORM["layers"]]})
        self.step(do="pose")
        self.step(do="adopt")
        self.await_gel(daemon)

        self.step(do="gel", form=FORM)
        self.assertIn("layer2.svg", self.step(do="sheet"))
        pose = self.step(do="pose")
        self.assertNotIn("fault", pose)
        self.assertTrue(self.get(view, "marked.png").startswith(b"\x89PNG"))
        self.step(do="adopt")
        self.await_gel(daemon)

        # Another page goes on where this one has ended, and so would another server.
        view.stop()
        view = self.view(daemon, "--setup", folder)
        self.connect(view)
        self.assertEqual(self.ask()["steps"]["gel"]["form"], FORM)
        zero = self.step(do="zero")
        self.assertEqual(zero["expected"], 1152)
        self.assertGreater(zero["present"], 1100)  # the picture's border cuts some
        geometry = self.step(do="measure", step="geometry")["figures"]
        self.step(do="measure", step="noise", seconds=2)
        for i, (scene, gf) in enumerate(zip(loaded, WEIGHTS_GF)):
            self.serve(scene)
            self.assertLess(abs(self.step(do="measure", step="weight", gf=gf, first=i == 0, seconds=60)["figures"]["reading_gf"]["value"] / gf - 0.9), 0.02)
        stiffness = self.step(do="measure", step="stiffness")["figures"]["youngs_modulus_pa"]
        print(f"  E {stiffness['value']:.0f} +- {stiffness['deviation']:.0f} Pa, z {geometry['position_z_mm']['value']:.2f} mm", end=" ")
        # The twin's gel does not creep; the gel file says that silicone usually does.
        self.assertAlmostEqual(stiffness["value"], HIDDEN["youngs_modulus_pa"], delta=2 * stiffness["deviation"])
        self.assertRegex(self.step(do="measure", step="finish", name="left")["path"], r"/state/left-.*\.toml$")
        self.step(do="adopt", calibrated=True)
        self.await_gel(daemon)
        field = self.rig.subscribe(daemon).collect(None, until=lambda field: field.valid)[-1]
        # The load stands since before the start: what the gel remembers is not known, and said not to be.
        self.assertTrue(field.header.flags & RECOVERING)
        self.assertAlmostEqual(field.resultant_N.z, 500 * rig.GRAM_FORCE, delta=0.03 * 500 * rig.GRAM_FORCE)
        self.assertAlmostEqual(json.loads(self.rig.ctl("--control", daemon.endpoint["control"], "describe")[1])["gel"]["youngs_modulus_Pa"],
                               stiffness["value"], delta=1e-3)
        self.expect_bound(view, daemon, folder)

    def expect_bound(self, view, daemon, folder):
        """What was made from one gel is not given for another."""
        calibrated = self.get(view, "calibrated.toml").decode()
        self.assertEqual(self.ask()["stale"], {})
        other = FORM | {"thickness_mm": 30, "youngs_modulus_kpa": 50}
        self.step(do="gel", form=other)
        state = self.ask()
        why = "plan.toml has changed since gel.toml was made: find the pose again"
        for step in ("pose", "tried", "zero", "geometry", "noise", "weights", "stiffness", "finish", "adopted"):
            self.assertEqual(state["stale"][step]["why"], why)
            self.assertNotIn(step, state["steps"])
        self.assertNotIn("calibrated.toml", state["files"])
        for name in ("calibrated.toml", "gel.toml"):
            self.assertTrue((folder / name).exists())
            with self.assertRaises(urllib.error.HTTPError):
                self.get(view, name)
        for request in ({"do": "adopt"}, {"do": "adopt", "calibrated": True}, {"do": "zero"}, {"do": "measure", "step": "geometry"}):
            self.assertIn(why, self.ask(request))
        print(f"\n  another gel is described: save and adopt say {why!r}; right: nothing of the gel before", end=" ")
        self.step(do="gel", form=FORM)  # the same again holds again
        self.assertEqual(self.get(view, "calibrated.toml").decode(), calibrated)
        (folder / "calibrated.toml").write_text(calibrated.replace("thickness_mm", "# thickness_mm"))
        self.assertIn("calibrated.toml is not the one that was made here", self.ask({"do": "adopt", "calibrated": True}))

        second = self.rig.start(rig.BIN / "traction-view", "--connect", daemon.endpoint["stream"], "--control", daemon.endpoint["control"],
                                "--listen", "0", "--setup", folder)
        self.assertEqual(second.join(), 75, second.output())
        self.assertIn("is in use by another setup", second.output())
        for how in ("cancel", "SIGTERM"):
            self.number += 1
            self.socket.send(f"ask {self.number} setup " + json.dumps({"do": "measure", "step": "creep", "seconds": 3600}))
            creep = self.number
            self.assertIn("wait for its end", self.ask({"do": "look"}))
            begin = time.monotonic()
            if how == "SIGTERM":
                self.assertEqual(view.stop(), 0)
            else:
                self.assertEqual(self.ask({"do": "cancel"}), {})
                while (answer := self.socket.receive()[1].split(b"\0", 1))[0] != b"error/%d" % creep:
                    pass
                self.assertIn("cancelled", answer[1].decode())
            print(f"\n  {how} of an hour of creep: ends after {time.monotonic() - begin:.2f} s; right: at once", end=" ")

    def test_the_page_leads_from_step_to_step(self):
        self.twin = None
        self.rig.twin("idle")
        daemon = self.rig.daemon(ADOPTED)
        view = self.view(daemon, "--setup", self.rig.folder / "setup")
        view.url += "#setup"  # as it is printed
        browser = self.browser(view)
        click = "[...document.querySelectorAll('#step button')].find((one) => one.textContent.startsWith('{}')).click()"

        def go(key):
            browser.evaluate("document.querySelector('#setup [aria-selected=true]').focus()")
            browser.ask(key=key)

        def expect_well(step):
            self.assertEqual(browser.evaluate("document.querySelector('#setup [aria-selected=true]').id"), f"step-{step}")
            self.assertEqual(browser.ask(accessibility=True), [])
            browser.ask(size=(390, 844))
            self.assertEqual(browser.evaluate("document.documentElement.scrollWidth"), 390, step)
            browser.ask(size=(1400, 900))

        browser.wait_for("document.querySelector('#step .picture')?.naturalWidth === 640 && document.querySelectorAll('#step .verdicts li.good').length === 2")
        expect_well("camera")
        go("ArrowRight")
        browser.wait_for("document.querySelector('#step canvas')?.width === 320")
        expect_well("lens")
        go("ArrowDown")

        def type_in(label, value):
            browser.evaluate(f"""(() => {{
              const field = [...document.querySelectorAll('#step .field')].find((one) => one.firstChild.textContent === {json.dumps(label)});
              const input = field.querySelector('input, select');
              input.value = {json.dumps(value)};
              input.dispatchEvent(new Event(input.tagName === 'SELECT' ? 'change' : 'input'));
            }})()""")

        drawn = "document.querySelectorAll('#step .drawings svg:last-child circle').length"
        self.assertEqual(browser.evaluate(drawn), 2 * 24 * 24)
        type_in("Columns", "20")
        self.assertEqual(browser.evaluate(drawn), (20 + 24) * 24)
        type_in("Columns", "90")
        self.assertIn("markers lie beside the gel", browser.evaluate("document.querySelector('#step .notes').innerText"))
        for label, value in (("Columns", "24"), ("Window", "none"), ("Refractive index of the gel", "1"), ("Focal length of the lens", "5.376")):
            type_in(label, value)
        expect_well("gel")
        browser.evaluate(click.format("Keep this gel"))
        browser.wait_for("document.querySelectorAll('#step a[download]').length === 2")
        go("ArrowRight")
        browser.evaluate(click.format("Take a picture"))
        browser.wait_for("document.querySelector('#step .marked img')?.naturalWidth === 1280 && document.querySelector('#step .figures')")
        expect_well("pose")
        browser.evaluate(click.format("Measure with this gel"))
        browser.wait_for("traction.model.field?.valid", 120)
        go("ArrowRight")
        browser.wait_for("document.querySelector('#step button.main')")
        browser.evaluate(click.format("Take the zero"))
        browser.wait_for("document.querySelector('#step .verdicts')?.innerText.includes('1152 of 1152 markers')")
        expect_well("zero")
        go("ArrowRight")
        browser.wait_for("document.querySelector('#step .reading')?.innerText.endsWith('gf')")
        expect_well("weights")
        go("ArrowRight")
        browser.wait_for("document.querySelector('#step .report')?.innerText.includes('24 × 24 blue markers')")
        expect_well("report")
        browser.evaluate("document.getElementById('setup-open').click()")
        browser.wait_for("!document.getElementById('setup') && traction.model.drawn > 0")
        self.assertEqual(browser.ask(requests=True)["faults"], [])

    def test_who_may_not_control_sets_nothing_up(self):
        folder = self.rig.folder / "setup"
        own = self.rig.folder / "own"
        own.mkdir()
        (own / "gel.toml").write_text("made by hand")
        for where, code, options in ((folder, 64, ("--read-only",)), (folder, 64, ("--instance", "left", "--instance", "right")),
                                     (folder, 64, ("--connect", "tcp://127.0.0.1:1")), (own, 73, ())):
            process = self.rig.start(rig.BIN / "traction-view", "--setup", where, *options)
            self.assertEqual(process.join(), code, process.output())
            self.assertIn("--setup" if code == 64 else "own/gel.toml is not of a setup, which would replace it", process.output())
        self.twin = None
        self.rig.twin("idle")
        daemon = self.rig.daemon()
        plain = self.view(daemon)
        self.connect(plain)
        self.assertIn("refused this viewer offers no setup", self.ask())
        self.assertEqual(self.status(plain, "/setup/plan.toml"), 404)

        view = self.view(daemon, "--setup", folder)
        self.connect(view)
        (self.rig.folder / "secret.toml").write_text("secret")
        self.step(do="gel", form=FORM)
        self.assertEqual(self.status(view, "/setup/plan.toml"), 200)
        for name in ("../secret.toml", "..%2fsecret.toml", "setup.json", "absent.png", ".toml", "", "%2e%2e/secret.toml"):
            self.assertEqual(self.status(view, f"/setup/{name}"), 404, name)
        for request in ({"do": "forget", "name": "../secret.toml"}, {"do": "no such step"}, {"do": "measure", "step": "no such step"},
                        {"do": "measure", "step": "weight", "gf": -1}, {"do": "lens", "columns": "10; true", "rows": 7, "square_mm": 10},
                        {"do": "gel", "form": []}, {"do": "gel", "form": FORM | {"layers": [1]}}, ["no object"],
                        {"do": "camera", "name": "x" * 65, "value": "1"}):
            self.assertIsInstance(self.ask(request), str, request)
        # A gel file that was not made here is none; and this daemon's is named in its configuration, and stays.
        (folder / "gel.toml").write_text((folder / "plan.toml").read_text())
        self.assertIn("there is no gel.toml yet", self.ask({"do": "adopt"}))
        self.step(do="gel", form=FORM)
        self.step(do="pose")
        self.assertIn('set sensor.gel_file = "adopted"', self.ask({"do": "adopt"}))
        self.assertEqual(daemon.stop(), 0, daemon.output())

    def test_pictures_of_a_chessboard_become_the_lens_of_the_gel(self):
        blank, squares = np.full((480, 640), 90.0), {"columns": 10, "rows": 7}
        boards = [chessboard(tilt, turn, place) for tilt, turn, place in (
            ((0.5, 0), 0.1, (0, 0)), ((-0.5, 0), -0.1, (6, 4)), ((0, 0.6), 0.0, (-6, 4)), ((0, -0.5), 0.2, (6, -4)),
            ((0.4, 0.4), -0.2, (-6, -4)), ((-0.4, 0.4), 0.0, (0, 3)), ((0.1, 0), 0.3, (0, -3)), ((0.4, -0.4), 0.1, (3, 0)))]
        noise = np.random.default_rng(1)
        shown = [np.clip(np.repeat(picture[:, :, None], 3, axis=2) + noise.normal(0, 1.5, (480, 640, 3)), 0, 255).astype(np.uint8).tobytes()
                 for picture in boards + [blank] * 8]
        file = self.rig.folder / "boards.raw"
        file.write_bytes(b"".join(shown))
        self.rig.twin("idle", "--serve", file, "--rate", 2, truth=False)
        view = self.view(self.rig.daemon(ADOPTED), "--setup", self.rig.folder / "setup")
        self.connect(view)
        taken, refused, different = 0, 0, set()
        while len(different) < 7 or refused == 0:
            told = self.ask({"do": "board"} | squares)
            if isinstance(told, str):
                self.assertIn("board-", told)
                self.assertIn("shows no chessboard of 10x7 squares", told)
                refused += 1
            else:
                taken += 1
                self.assertEqual(len(told["outlines"][told["name"]]), 8)
                different.add(tuple(told["outlines"][told["name"]]))
        boards = self.ask()["boards"]
        self.assertEqual(len(boards), taken, "what shows no board is not kept")
        folder = self.rig.folder / "setup"
        (folder / "board-left.png").write_bytes(b"the user's own")
        before = {path.name: path.read_bytes() for path in folder.glob("board-*.png")}
        new = []
        while len(new) < 2:
            told = self.ask({"do": "board"} | squares)
            new += [told["name"]] if isinstance(told, dict) else []
        for name, content in before.items():
            self.assertEqual((folder / name).read_bytes(), content, name)
        print(f"\n  two pictures beside board-left.png and {boards[-1]}: {', '.join(new)}; right: the next two numbers", end=" ")
        largest = int(boards[-1][len("board-"):-len(".png")])
        self.assertEqual(new, [f"board-{largest + i:03}.png" for i in (1, 2)])
        for name in ("board-left.png", *new):
            self.step(do="forget", name=name)
        self.assertEqual(self.step(do="forget", name=boards[0])["boards"], boards[1:])
        lens = self.step(do="lens", **squares, square_mm=10)
        figures = {figure["name"]: figure for figure in lens["figures"]}
        print(f"\n  {lens['pictures']} pictures, {refused} refused: focal length {figures['focal_px']['value']:.1f} +- "
              f"{figures['focal_px']['deviation']:.1f} px, 960 are true", end=" ")
        self.assertLess(abs(figures["focal_px"]["value"] - 960), 5 * figures["focal_px"]["deviation"])
        self.assertEqual(self.step(do="gel", form=FORM | {"lens_mm": None}), {"lens_measured": True})
        plan = (self.rig.folder / "setup" / "plan.toml").read_text()
        self.assertAlmostEqual(float(re.search(r"focal_px = ([\d.]+)", plan)[1]), figures["focal_px"]["value"], delta=0.01)

    def status(self, view, path):
        """Of an HTTP request, whose path no library mends."""
        with socket.create_connection(("127.0.0.1", view.port), timeout=HUNG_S) as connection:
            connection.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\nConnection: close\r\n\r\n".encode())
            return int(connection.recv(64).split()[1])

    def get(self, view, name):
        with urllib.request.urlopen(f"{view.url}setup/{name}") as answer:
            return answer.read()


if __name__ == "__main__":
    unittest.main()

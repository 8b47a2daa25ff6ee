"""traction-view's page: what a browser sees of a daemon."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request

import numpy as np

from browser import TestCase
from rig import BIN, PATIENCE, SOURCE

PAGE_LIMIT = 400_000  # bytes, compressed


class Page(TestCase):
    def draw_loads(self):
        """A press, a twist, two contacts and an object bent along an arc, one after another, drawn at random: a scenario."""
        draw = self.draw
        loads, text = {}, "format = 1\n"
        begin = 4.0
        for kind in ("press", "twist", "two", "curved"):
            x, y, turn = draw.uniform(-16, 16), draw.uniform(-16, 16), draw.uniform(0, 2 * np.pi)
            if kind == "two":
                places = [(-9 * np.cos(turn) - 4, -9 * np.sin(turn)), (9 * np.cos(turn) - 4, 9 * np.sin(turn))]
            elif kind == "curved":
                places = [(0.5 * x + 12 * np.cos(turn + 0.55 * i), 0.5 * y + 12 * np.sin(turn + 0.55 * i)) for i in range(4)]
            else:
                places = [(x, y)]
            for place in places:
                normal = draw.uniform(1.5, 3) if kind != "curved" else draw.uniform(0.8, 1.2)
                shear = np.zeros(2) if kind == "twist" else 0.25 * normal * np.array([draw.uniform(-1, 1), draw.uniform(-1, 1)])
                torque = draw.choice([-1, 1]) * draw.uniform(5, 8) if kind == "twist" else 0
                held = lambda value: [0, float(value), float(value), 0]  # noqa: E731
                text += (f'[[contacts]]\nshape = "hertz"\nradius_mm = {draw.uniform(3, 5) if kind != "twist" else 5}\n'
                         f"time_s = {[begin, begin + 0.5, begin + 4, begin + 4.5]}\nx_mm = {place[0]}\ny_mm = {place[1]}\n"
                         f"force_x_n = {held(shear[0])}\nforce_y_n = {held(shear[1])}\nforce_z_n = {held(normal)}\n"
                         f"torque_n_mm = {held(torque)}\n")
            loads[kind] = (begin + 0.5, begin + 4)
            begin += 5
        file = self.rig.folder / "loads.toml"
        file.write_text(text.replace("format = 1\n", f"format = 1\nperiod_s = {begin}\n"))
        return file, loads, begin

    def test_arrows_are_where_and_as_long_as_the_twin_has_them(self):
        """TRACTION_PICTURES=FOLDER keeps what was seen."""
        file, loads, period_s = self.draw_loads()
        twin = self.rig.twin(file)
        daemon = self.rig.daemon()
        browser = self.browser(self.view(daemon))
        browser.wait_for("window.traction?.model?.arrows && traction.model.vectors && traction.model.description.zero")
        pictures = os.environ.get("TRACTION_PICTURES")
        samples, deadline = {}, time.monotonic() + 6 * period_s * PATIENCE
        while len(samples) < len(loads) and time.monotonic() < deadline:
            # Of one frame, whichever it is: what was drawn last is what came last.
            seen = browser.evaluate("""(async () => {
              const model = traction.model;
              do await new Promise(requestAnimationFrame);
              while (model.drawn_sequence !== model.field.header.sequence ||
                     model.vectors.sequence !== model.drawn_sequence || !model.field.valid || model.field.header.flags.includes("torn"));
              const {node, from_px, to_px, px_per_N} = model.arrows;
              return {id: Number(model.field.header.camera_frame_id), node, from_px, to_px, px_per_N,
                      rest: Array.from(model.description.zero.rest_position_px), layers: model.description.layers,
                      nodes: model.description.nodes, places: Array.from(model.places_px),
                      vectors: {...model.vectors, sequence: Number(model.vectors.sequence)},
                      force: Array.from(model.field.force_N), at: Array.from(model.positions_mm)};
            })()""")
            known = {record["camera_frame_id"]: record for record in map(json.loads, (
                line for line in twin.truth_file.read_text().splitlines(keepends=True) if line.endswith("}\n")))}
            truth = known.get(seen["id"])
            now = truth["scenario_s"] % period_s if truth else -1
            for kind, (begin, end) in loads.items():
                if kind not in samples and begin < now < end:
                    samples[kind] = seen, truth
                    if pictures:
                        browser.ask(picture=f"{pictures}/{kind}.png")
        self.assertEqual(set(samples), set(loads))
        for kind, (seen, truth) in samples.items():
            self.check_arrows(kind, seen, truth)
        # Registered: a node lies in the picture among the markers above and below it, by their grid.
        self.check_registered(seen)

    def check_arrows(self, kind, seen, truth):
        start, end = (np.reshape(seen[name], (-1, 2)) for name in ("from_px", "to_px"))
        drawn = (end - start) * [1, -1] / seen["px_per_N"]  # the picture's v points down
        at = np.reshape(seen["at"], (-1, 3))[:, :2]
        true = np.array(truth["force_N"])
        size = np.linalg.norm(true)
        vectors = np.reshape(np.array(seen["vectors"]["to_mm"]) - np.array(seen["vectors"]["from_mm"]), (-1, 3))
        vectors /= seen["vectors"]["mm_per_N"]
        force = np.reshape(seen["force"], (-1, 3))
        print(f"\n  {kind}: arrows sum up to {np.round(drawn.sum(axis=0), 3)}, vectors to {np.round(vectors.sum(axis=0), 3)} N, "
              f"the twin's truth is {np.round(true, 3)} N", end=" ")
        np.testing.assert_allclose(drawn.sum(axis=0), true[:2], atol=0.05 * size)
        np.testing.assert_allclose(force.sum(axis=0), true, atol=0.1 * size)
        # Each of the vectors is its node's force; those that would be too short to see are not drawn.
        np.testing.assert_allclose(vectors, force[seen["vectors"]["node"]], atol=1e-5 * size)
        left = np.delete(np.linalg.norm(force, axis=1), seen["vectors"]["node"])
        self.assertLess(left.max(), 0.0301 * seen["vectors"]["full_N"])
        strongest = at[np.argmax(np.linalg.norm(force, axis=1))]
        places = [1e3 * np.array(contact["position_m"][:2]) for contact in truth["contacts"]]
        self.assertLess(min(np.linalg.norm(strongest - place) for place in places), 6.0)  # two nodes
        if kind in ("twist", "two"):
            # Of each contact its own arrows: those that are nearest to it.
            nearest = np.argmin([np.linalg.norm(at[seen["node"]] - place, axis=1) for place in places], axis=0)
            for number, (contact, place) in enumerate(zip(truth["contacts"], places)):
                own = drawn[nearest == number]
                np.testing.assert_allclose(own.sum(axis=0), contact["force_N"][:2], atol=0.1 * size)
                arm = at[seen["node"]][nearest == number] - place
                torque = (arm[:, 0] * own[:, 1] - arm[:, 1] * own[:, 0]).sum()
                if kind == "twist":
                    print(f"\n  they turn by {torque:.2f} N mm, the truth is {1e3 * contact['torque_Nm']:.2f}", end=" ")
                    self.assertAlmostEqual(torque / (1e3 * contact["torque_Nm"]), 1, delta=0.25)

    def check_registered(self, seen):
        """The nodes' places and the markers' own, as two maps from gel to picture: they differ by the depth alone."""
        layer = seen["layers"][0]
        count = layer["columns"] * layer["rows"]
        markers = np.reshape(seen["rest"], (-1, 2))[:count]
        nodes = np.reshape(seen["places"], (-1, 2))

        def spread(grid):
            column, row = np.meshgrid(np.arange(grid["columns"]), np.arange(grid["rows"]))
            x = grid["centre_m"][0] + grid["pitch_m"] * (column - (grid["columns"] - 1) / 2)
            y = grid["centre_m"][1] + grid["pitch_m"] * (row - (grid["rows"] - 1) / 2)
            return np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)

        of_markers = np.linalg.lstsq(spread(layer), markers, rcond=None)[0]
        of_nodes = np.linalg.lstsq(spread(seen["nodes"]), nodes, rcond=None)[0]
        distance = np.linalg.norm(of_markers[2] - of_nodes[2])
        ratio = of_nodes[0, 0] / of_markers[0, 0]
        print(f"\n  the nodes' centre is {distance:.2f} px from the markers', their scale {ratio:.4f} of theirs", end=" ")
        self.assertLess(distance, 1.0)
        self.assertTrue(0.9 < ratio < 1.0, ratio)  # farther away by the layer's depth

    def test_contacts_of_traction_touch_are_shown_while_it_runs(self):
        scenario = self.rig.folder / "shear.toml"
        scenario.write_text('format = 1\nperiod_s = 1000000\n' + "".join(
            f'[[contacts]]\nshape = "hertz"\nradius_mm = 5\ntime_s = [4, 5]\nx_mm = {x}\ny_mm = {y}\n'
            f"force_x_n = [0, {shear}]\nforce_z_n = [0, {normal}]\n" for x, y, shear, normal in ((-9, 5, 1.5, 3), (10, -4, 0, 2))))
        self.rig.twin(scenario)
        self.rig.daemon()
        session = self.rig.folder / "session"
        (session / "tractiond").mkdir(parents=True)
        (session / "tractiond" / "default").symlink_to(self.rig.folder / "default" / "run")
        session = {"XDG_RUNTIME_DIR": str(session)}
        view = self.view(None, "--instance", "default", env=session)
        browser = self.browser(view)
        rows = "document.querySelectorAll('#contacts .tracked')"
        browser.wait_for("window.traction?.model?.field?.contacts.length === 2")
        self.assertEqual(browser.evaluate(f"traction.model.tracked === null && {rows}.length"), 0)
        touch = self.rig.start(BIN / "traction-touch", env=session)
        browser.wait_for(f"traction.model.tracked?.length === 2 && {rows}.length === 2")
        browser.wait_for(f"[...{rows}].every((row) => row.dataset.state !== 'absent')")
        told = browser.evaluate(f"[...{rows}].map((row) => row.innerText)")
        print("\n  " + "; ".join(" ".join(each.split()) for each in told), end=" ")
        for each in told:
            self.assertRegex(" ".join(each.split()), r"^\d+ ([0-9.]+ N|–) [0-9.]+ s (no valid field|absent|slip unknown|(sticks|about to slip|slips) · stick ratio [01].* friction .*)$")
        if pictures := os.environ.get("TRACTION_PICTURES"):
            browser.wait_for("traction.model.tracked.every(({phase}) => phase === 'move')")
            browser.ask(picture=f"{pictures}/contacts.png")
        self.check_stick_and_slip(browser)
        touch.stop(signal.SIGKILL)
        browser.wait_for(f"traction.model.tracked === null && {rows}.length === 0")
        self.assertEqual(browser.ask(requests=True)["faults"], [])

    def check_stick_and_slip(self, browser):
        """The shear of the twin's contact follows its pressure: all of it slips. Of the contact without shear nothing is known."""
        browser.wait_for("traction.model.tracked.filter(({slip}) => slip && slip.state !== 'unknown').length === 1 && "
                         "traction.model.stick_slip.some(({share}) => share !== null)")
        nodes = browser.evaluate("""(async () => {
          do await new Promise(requestAnimationFrame); while (!traction.model.stick_slip.some(({share}) => share !== null));
          const canvas = document.querySelector("#view-c canvas"), context = canvas.getContext("2d"), zoom = canvas.width / canvas.clientWidth;
          const loaded = ({force_N: [x, y]}) => Math.hypot(x, y) > 0.5;
          const sheared = traction.model.tracked.find(loaded)?.id;
          return traction.model.stick_slip.map(({contact, share, at_px: [u, v]}) => ({sheared: contact === sheared, share,
            colour: Array.from(context.getImageData(Math.round(zoom * u), Math.round(zoom * v), 1, 1).data.slice(0, 3))}));
        })()""")
        shares = [node["share"] for node in nodes if node["sheared"] and node["share"] is not None]
        unknown = [node for node in nodes if not node["sheared"]]
        print(f"\n  shear of nodes over friction: {np.mean(shares):.2f} +- {np.std(shares):.2f}; {len(unknown)} not known", end=" ")
        self.assertGreater(len(shares), 3)
        self.assertAlmostEqual(np.mean(shares), 1, delta=0.15)
        self.assertGreater(len(unknown), 3)
        def reddish(nodes):  # or hollow: the contours are blue to yellow
            return np.mean([red > 90 and max(green, blue) < 80 for red, green, blue in (node["colour"] for node in nodes)])
        self.assertGreater(reddish([node for node in nodes if node["share"] is not None]), 0.7)  # an outline may lie over it
        self.assertEqual(reddish(unknown), 0)
        self.assertEqual({node["share"] for node in unknown}, {None})
        self.assertFalse(browser.evaluate("document.getElementById('legend-c').hidden"))

    def test_nothing_is_asked_for_elsewhere_and_the_page_is_light(self):
        self.rig.twin("two_contacts")
        view = self.view(self.rig.daemon())
        weight = sum(len(urllib.request.urlopen(view.url + file).read()) for file in ("", "app.js", "app.css", "icon.svg"))
        print(f"\n  the page weighs {weight} bytes compressed", end=" ")
        self.assertLess(weight, PAGE_LIMIT)
        browser = self.browser(view)
        browser.wait_for("window.traction?.model?.drawn > 3 && traction.model.status")
        seen = browser.ask(requests=True)
        own = (view.url, view.url.replace("http", "ws"))
        foreign = [url for url in seen["requests"] if not url.startswith((*own, "data:", "blob:"))]
        print(f"\n  {len(seen['requests'])} requests, {len(foreign)} outside its own origin", end=" ")
        self.assertEqual(foreign, [])
        self.assertEqual(seen["faults"], [])
        serious = [one for one in browser.ask(accessibility=True) if one["impact"] in ("serious", "critical")]
        self.assertEqual(serious, [])

    def test_a_touch_is_large_in_the_views_is_read_under_the_pointer_and_stays_as_a_ghost(self):
        x, y, pressed_N = self.draw.uniform(-15, 15), self.draw.uniform(-15, 15), 4
        scenario = self.rig.folder / "touch.toml"
        scenario.write_text(f'format = 1\nperiod_s = 60\n[[contacts]]\nshape = "hertz"\nradius_mm = 5\ntime_s = [6, 7, 40, 41]\n'
                            f"x_mm = {x}\ny_mm = {y}\nforce_x_n = [0, 0.8, 0.8, 0]\nforce_z_n = [0, {pressed_N}, {pressed_N}, 0]\n")
        self.rig.twin(scenario)
        cache = self.rig.folder / "cache"
        view = self.view(self.rig.daemon("[solve]\npatience_ms = 1000\n"), env={"XDG_CACHE_HOME": str(cache)})
        browser = self.browser(view)
        coarse_ms, whole_ms = browser.evaluate("""(async () => {
          const when = async (holds) => { while (!holds()) await new Promise(requestAnimationFrame); return Math.round(performance.now()); };
          return [await when(() => window.traction?.model?.displacement_mm.length > 0), await when(() => traction.model.surface_share === 1)];
        })()""")
        print(f"\n  a new gel's surface after {coarse_ms} ms, as a half space's; {whole_ms} ms, its own", end=" ")
        browser.wait_for(f"traction.model.field?.valid && traction.model.field.resultant_N[2] > {0.9 * pressed_N}")
        self.assertEqual(len(list((cache / "traction").iterdir())), 1)
        share = browser.evaluate("""(async () => {
          const {views: {d}, model} = traction, {width, height} = d.stage.canvas;
          do await new Promise(requestAnimationFrame); while (!(d.box && d.stage.isSettled && model.field.valid));
          const look = (isVisible) => {
            d.shafts.visible = d.heads.visible = isVisible;
            d.draw(model);
            const context = new OffscreenCanvas(width, height).getContext("2d");
            context.drawImage(d.stage.canvas, 0, 0);
            return context.getImageData(0, 0, width, height).data;
          };
          const without = look(false), seen = look(true);
          let left = width, right = 0, top = height, low = 0;
          for (let i = 0; i < seen.length; i += 4) {
            if (Math.abs(seen[i] - without[i]) + Math.abs(seen[i + 1] - without[i + 1]) + Math.abs(seen[i + 2] - without[i + 2]) < 60) continue;
            const u = (i / 4) % width, v = Math.floor(i / 4 / width);
            left = Math.min(left, u), right = Math.max(right, u), top = Math.min(top, v), low = Math.max(low, v);
          }
          return ((right - left) * (low - top)) / (width * height);
        })()""")
        print(f"\n  the arrows of a contact of 10 mm take {100 * share:.0f} % of view d", end=" ")
        self.assertTrue(0.3 < share < 0.95, share)
        seen = browser.evaluate("""(async () => {
          const {model} = traction, canvas = document.querySelector("#view-c canvas"), box = canvas.getBoundingClientRect();
          const [x, y] = model.field.contacts[0].position_m, told = {};
          for (const quantity of ["both", "pressure", "shear"]) {
            document.querySelector(`[data-contours=${quantity}]`).click();
            // The pointer looks for the contact: the page says at which millimetres it is.
            let u = box.width / 2, v = box.height / 2;
            for (let i = 0; i < 8; ++i) {
              canvas.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + u, clientY: box.top + v}));
              do await new Promise(requestAnimationFrame); while (!model.pointed);
              const {at_mm, mm_per_px} = model.pointed;
              u += (1e3 * x - at_mm[0]) / mm_per_px, v -= (1e3 * y - at_mm[1]) / mm_per_px;
            }
            told[quantity] = {...model.pointed, ...model.contours};
          }
          return told;
        })()""")
        print("\n  " + "; ".join(f"{name}: {one['text']}" for name, one in seen.items()), end=" ")
        radius_m = 5e-3
        for name, one in seen.items():
            np.testing.assert_allclose(one["at_mm"], [x, y], atol=1.5)
            force_N = {"pressure": pressed_N, "shear": 0.8, "both": np.hypot(pressed_N, 0.8)}[name]
            off_m = 1e-3 * np.linalg.norm(np.array(one["at_mm"]) - [x, y])
            hertz_kPa = 1.5e-3 * force_N / (np.pi * radius_m**2) * np.sqrt(1 - (off_m / radius_m) ** 2)
            self.assertAlmostEqual(one["kPa"] / hertz_kPa, 1, delta=0.15)
            self.assertGreater(one["deviation_kPa"], 0)
            self.assertLess(one["kPa"], 1.05 * one["full_kPa"])
            self.check_numbers_on_lines(one)
        self.assertRegex(browser.evaluate("document.getElementById('scale-c').textContent"), "most [0-9]+ (k|)Pa by the contact's model")
        self.check_depth(browser, pressed_N, radius_m)
        picture = browser.evaluate("""(async () => {
          const saved = new Promise((done) => { HTMLAnchorElement.prototype.click = function () { done([this.download, this.href]); }; });
          document.getElementById("png").click();
          const [name, url] = await saved, picture = Object.assign(new Image(), {src: url});
          await picture.decode();
          return {name, width: picture.width, height: picture.height};
        })()""")
        self.assertRegex(picture["name"], r"^default-force-.*\.png$")
        self.assertEqual((picture["width"], picture["height"]), (1600, 600))
        rows = browser.evaluate("traction.plot.csv()").splitlines()
        self.assertEqual(rows[0].split(",")[:4], ["time_s", "force_x_N", "force_y_N", "force_z_N"])
        self.assertAlmostEqual(float(rows[-1].split(",")[3]), pressed_N, delta=0.1 * pressed_N)
        browser.wait_for("traction.model.isGhost && /^last touch, /.test(document.getElementById('scale-d').textContent)")
        self.assertGreater(browser.evaluate("traction.views.d.shafts.count"), 0)
        self.assertEqual(browser.ask(requests=True)["faults"], [])

    def check_numbers_on_lines(self, contours):
        numbers = contours["numbers"]
        self.assertGreater(len(numbers), 0)
        for i, one in enumerate(numbers):
            self.assertLess(min(abs(one["kPa"] - level) for level in contours["levels_kPa"]), 1e-6)
            self.assertAlmostEqual(float(one["text"]) * {"MPa": 1e3, "kPa": 1, "Pa": 1e-3}[one["unit"]], one["kPa"], delta=0.06 * one["kPa"])
            left, top, right, low = one["box"]
            for other in numbers[:i]:
                a, b, c, d = other["box"]
                self.assertFalse(left < c and a < right and top < d and b < low, (one, other))

    def check_depth(self, browser, pressed_N, radius_m):
        """In the middle of a ball's contact, by Hertz, less what the block's base and sides hold: not that of even squares."""
        seen = browser.evaluate("({depth_mm: traction.model.surface.deepest_mm, gel: traction.model.description.gel})")
        hertz_mm = 750 * pressed_N * (1 - seen["gel"]["poisson_ratio"] ** 2) / (radius_m * seen["gel"]["youngs_modulus_Pa"])
        expected_mm = hertz_mm - 0.053 * pressed_N  # mm/N, by CalculiX: beside a contact's rim, at a contact of 10 mm
        print(f"\n  {seen['depth_mm']:.3f} mm deep, {expected_mm:.3f} is expected", end=" ")
        self.assertAlmostEqual(seen["depth_mm"] / expected_mm, 1, delta=0.05)

    def test_a_body_is_drawn_with_its_arrows_at_its_nodes(self):
        """The example of an influence file, a dome."""
        examples = SOURCE / "docs" / "examples"
        gel = self.rig.folder / "dome.toml"
        gel.write_text((examples / "dome.toml").read_text())
        subprocess.run([sys.executable, examples / "write_influence.py", self.rig.folder / "dome.npz", "--radius", "1"], check=True)
        self.rig.twin("hold")
        browser = self.browser(self.view(self.rig.daemon(f'[sensor]\ngel_file = "{gel}"\n[solve]\npatience_ms = 1000\n')))
        browser.wait_for("window.traction?.model?.description?.body && traction.model.field?.resultant_N[2] > 1 && traction.model.preview")
        seen = browser.evaluate("""(async () => {
          const {model, views} = traction;
          do await new Promise(requestAnimationFrame);
          while (!(model.drawn_sequence === model.field.header.sequence && model.vectors?.sequence === model.drawn_sequence && model.vectors.node.length > 3));
          const {arrows: {node, from_px}, vectors, description: {body}, field, places_px} = model;
          return {node, from_px, vectors: {...vectors, sequence: 0}, places_px: Array.from(places_px), force_N: Array.from(field.force_N),
                  at_m: Array.from(body.node_positions_m), normals: Array.from(body.node_normals),
                  scale: document.getElementById("scale-a").textContent, hasAxes: views.a.axes.visible};
        })()""")
        at_mm, force, normals = (np.reshape(seen[name], (-1, 3)) for name in ("at_m", "force_N", "normals"))
        at_mm = 1e3 * at_mm
        self.assertGreater(np.ptp(at_mm[:, 2]), 1)
        places = np.reshape(seen["places_px"], (-1, 2))
        np.testing.assert_allclose(np.reshape(seen["from_px"], (-1, 2)), places[seen["node"]], atol=1e-3)
        own = seen["vectors"]["node"]
        start, end = (np.reshape(seen["vectors"][name], (-1, 3)) for name in ("from_mm", "to_mm"))
        pressed = (force[own] * normals[own]).sum(axis=1) > 0  # those end at their nodes
        np.testing.assert_allclose(np.where(pressed[:, None], end, start), at_mm[own], atol=1e-3)
        np.testing.assert_allclose((end - start) / seen["vectors"]["mm_per_N"], force[own], atol=1e-5 * np.linalg.norm(force))
        self.assertRegex(seen["scale"], "orange .* a node")
        self.assertFalse(seen["hasAxes"])
        for key in ("1", "2", "3", "4", "0"):
            browser.ask(key=key)
            drawn = browser.evaluate("traction.model.drawn")
            browser.wait_for(f"traction.model.drawn > {drawn + 2}")
        if pictures := os.environ.get("TRACTION_PICTURES"):
            browser.ask(picture=f"{pictures}/body.png")
        self.assertEqual(browser.ask(requests=True)["faults"], [])

    def test_nothing_of_another_sensor_or_of_before_is_shown_as_of_now(self):
        self.rig.twin("press")
        daemon = self.rig.daemon()
        browser = self.browser(self.view(daemon, "--instance", "absent"))
        browser.wait_for("document.querySelectorAll('#sensors button').length === 2")
        absent, present = (f"document.querySelectorAll('#sensors button')[{i}].click()" for i in range(2))
        browser.evaluate(present)
        browser.wait_for("traction.model.isTouched && document.querySelector('#magnitude').textContent !== '–'")
        browser.evaluate("document.querySelector('#pause').click()")
        browser.evaluate(absent)
        browser.wait_for("document.querySelector('#magnitude').textContent === '–'")
        browser.wait_for("traction.model.drawn > 0")
        self.assertEqual(browser.evaluate("""[...document.querySelectorAll(".view .scale")].map((label) => label.textContent)"""), 4 * [""])
        self.assertFalse(browser.evaluate("traction.views.a.stage.gel.visible || traction.views.d.stage.gel.visible"))
        browser.evaluate(present)
        browser.wait_for("document.querySelector('#magnitude').textContent !== '–'")
        daemon.kill()
        browser.wait_for("document.body.classList.contains('stale')")
        browser.wait_for("[...document.querySelectorAll('#sensors small')].every((force) => force.textContent === '–')")
        self.assertEqual(browser.ask(requests=True)["faults"], [])

    def test_a_phone_shows_all_views(self):
        self.rig.twin("idle")
        browser = self.browser(self.view(self.rig.daemon()), width=390, height=844)
        browser.wait_for("window.traction?.model?.drawn > 3")
        boxes = browser.evaluate("""[...document.querySelectorAll("#views .view")].map((view) => {
          const {left, right, height} = view.getBoundingClientRect();
          return {left, right, height};
        })""")
        self.assertEqual(len(boxes), 4)
        for box in boxes:
            self.assertGreaterEqual(box["left"], 0)
            self.assertLessEqual(box["right"], 390)
            self.assertGreater(box["height"], 150)
        self.assertEqual(browser.evaluate("document.documentElement.scrollWidth"), 390)

    def test_the_cameras_picture_lies_where_the_markers_are(self):
        self.rig.twin("idle")
        browser = self.browser(self.view(self.rig.daemon()))
        browser.wait_for("window.traction?.model?.preview && traction.model.description?.zero")
        # How the markers' light differs at their places from that a quarter of the grid's pitch beside and below.
        seen = browser.evaluate("""(() => {
          const {preview: {canvas, width, height, scale, origin_px: [left, top]}, description: {layers, zero}} = traction.model;
          const {data} = canvas.getContext("2d").getImageData(0, 0, width, height);
          const light = (u, v, channel) => data[4 * (Math.round((v - top) / scale) * width + Math.round((u - left) / scale)) + channel];
          let i = 0;
          return {width, height, scale, contrasts: layers.map(({colour, columns, rows}) => {
            const channel = {red: 0, green: 1, blue: 2}[colour] ?? 0, end = i + 2 * columns * rows;
            const beside = Math.hypot(zero.rest_position_px[i + 2] - zero.rest_position_px[i], zero.rest_position_px[i + 3] - zero.rest_position_px[i + 1]) / 4;
            let at = 0, off = 0;
            for (; i < end; i += 2) {
              const [u, v] = zero.rest_position_px.slice(i, i + 2);
              at += light(u, v, channel);
              off += light(u + beside, v + beside, channel);
            }
            return (at - off) / (columns * rows);
          })};
        })()""")
        print(f"\n  {seen['width']} x {seen['height']}, markers stand out by {np.round(seen['contrasts'], 1)} levels", end=" ")
        self.assertGreater(min(map(abs, seen["contrasts"])), 5)

    def test_what_is_recorded_is_shown_again(self):
        """By the buttons, as who looks would do it; each number of a moment is the one that another subscriber has of it."""
        file, _, _ = self.draw_loads()
        self.rig.twin(file)
        daemon = self.rig.daemon()
        folder = self.rig.folder / "recordings"
        folder.mkdir()
        browser = self.browser(self.view(daemon, "--recordings", folder))
        browser.wait_for("window.traction?.model?.field && traction.model.description?.zero && traction.model.preview")
        witness = self.rig.subscribe(daemon, "traction/v1/default/field/")
        browser.ask(key="r")
        browser.wait_for("traction.model.recorder?.file")
        witness.collect(10)
        browser.wait_for("document.getElementById('record').getAttribute('aria-pressed') === 'true'")  # with the next texts
        known = {field.header.sequence: field for field in witness.collect(480)}
        browser.ask(key="r")
        browser.wait_for("!traction.model.recorder.file")
        recording, = folder.iterdir()
        self.assertRegex(recording.name, r"^[\w-]*\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d\.mcap$")
        code, text = self.rig.ctl("info", recording)
        self.assertEqual(code, 0, text)

        choice = "document.getElementById('recordings')"
        browser.evaluate(f"{choice}.focus()")
        browser.wait_for(f"[...{choice}.options].some(({{value}}) => value === '{recording.name}')")
        browser.evaluate(f"{choice}.value = '{recording.name}', {choice}.dispatchEvent(new Event('change'))")
        browser.wait_for("traction.model.time?.at_s > 0.5 && traction.model.field && traction.model.preview")
        length_s = browser.evaluate("traction.model.time.length_s")
        self.assertGreater(length_s, 7.9)
        compared = 0
        for _ in range(10):
            at_s = self.draw.uniform(0.5, length_s - 0.5)
            browser.evaluate(f"(() => {{ const bar = document.getElementById('at'); bar.value = {at_s};"
                             "for (const kind of ['input', 'change']) bar.dispatchEvent(new Event(kind)); })()")
            time.sleep(0.1)
            if browser.evaluate("traction.model.time.speed > 0"):
                browser.ask(key=" ")
            browser.wait_for("(({field: {header}, time}) => time.speed === 0 &&"
                             " Math.abs(Number(header.received_real_ns) / 1e9 - time.begin_s - time.at_s) < 0.5)(traction.model)")
            shown = browser.evaluate(
                "(({field: {header, resultant_N, force_N}}) => ({sequence: Number(header.sequence),"
                " resultant_N: [...resultant_N], force_N: [...force_N]}))(traction.model)")
            field = known.get(shown["sequence"])
            if field is None:  # before the witness came, or after it went
                continue
            compared += 1
            self.assertEqual(shown["resultant_N"], [field.resultant_N.x, field.resultant_N.y, field.resultant_N.z])
            self.assertEqual(shown["force_N"], list(field.force_N))
        self.assertGreater(compared, 5)
        browser.ask(key=" ")  # goes on
        browser.wait_for("traction.model.time.at_s === traction.model.time.length_s")
        print(f"\n  {compared} moments of {length_s:.1f} s as recorded", end=" ")
        if pictures := os.environ.get("TRACTION_PICTURES"):
            browser.ask(picture=f"{pictures}/recording.png")
        browser.evaluate(f"{choice}.value = '', {choice}.dispatchEvent(new Event('change'))")
        browser.wait_for("traction.model.time === null && traction.model.fields > 0")
        self.assertEqual(browser.ask(requests=True)["faults"], [])

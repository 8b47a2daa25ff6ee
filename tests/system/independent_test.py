"""Signs, mirrors, places and the sense of torsion through the daemon, from pictures that none of our programs drew."""

import collections
import functools
import unittest

import numpy as np

import independent
import rig

REST, RAMP, HOLD = 45, 6, 12  # frames
STRAIGHT = independent.Camera()
ASKEW = independent.Camera(position_m=(0.002, -0.001, 0.178), rotation_rad=(0.012, -0.02, 0.05), k1=-0.15, k2=0.05,
                           principal_px=(335.0, 258.0), gel_index=1.41, window_index=1.49, window_thickness_m=0.01)
# What is pressed where: [m], [N], [N m], and the markers' displacement [m].
Load = collections.namedtuple("Load", "place force torque displacement")


def half_space():
    """Magnitudes and places differ, so that every mirror shows."""
    contacts = {"press": ((0.012, 0.006), 0.004, (0, 0, 4), 0), "shear x": ((-0.006, 0.003), 0.006, (2, 0, 0), 0),
                "shear y": ((0.003, -0.009), 0.006, (0, 1.5, 0), 0), "torsion": ((0, 0), 0.010, (0, 0, 0), 0.03)}
    return {name: Load(place, force, torque, independent.contact(place, radius, force, torque))
            for name, (place, radius, force, torque) in contacts.items()}


def block():
    """Finite elements of others; y by mirroring gel and markers in their diagonal."""
    path = rig.SOURCE / "tests" / "golden" / "block_reference.csv"
    press, shear = (independent.finite_elements(path, case) for case in "AB")
    mirrored = shear.reshape(2, 24, 24, 3).swapaxes(1, 2)[..., [1, 0, 2]].reshape(shear.shape)
    return {"press": Load((0.0007, 0.0004), (0, 0, 4), 0, 4 * press),
            "shear x": Load((0.0007, 0.0004), (2, 0, 0), 0, 2 * shear),
            "shear y": Load((0.0004, 0.0007), (0, 1.5, 0), 0, 1.5 * mirrored)}


class Truth(unittest.TestCase):
    def test_half_space_obeys_navier(self):
        p, h = np.array([0.004, -0.003, 0.006]), 3e-5 * np.eye(3)
        for nu in (0.0, 0.3, 0.49):
            def u(at):
                return independent.influence(at, nu)

            def divergence(at):
                return sum(u(at + h[i])[i] - u(at - h[i])[i] for i in range(3)) / 6e-5

            laplacian = sum(u(p + step) + u(p - step) - 2 * u(p) for step in h) / 9e-10
            gradient = np.array([divergence(p + step) - divergence(p - step) for step in h]) / 6e-5
            self.assertLess(abs((1 - 2 * nu) * laplacian + gradient).max(), 1e-3 * abs(laplacian).max())

    def test_markers_are_drawn_where_they_are_projected(self):
        for camera in (STRAIGHT, ASKEW):
            pixels = camera.project(independent.markers())
            for layer, channel in ((0, 2), (1, 0)):
                signal = independent.picture(camera, pixels, (layer,))[..., channel] - independent.BACKGROUND
                for u, v in pixels[layer]:
                    columns, rows = (round(x) + np.arange(-independent.REACH_PX, independent.REACH_PX + 1) for x in (u, v))
                    part = signal[np.ix_(rows, columns)]
                    self.assertLess(abs(part.sum(0) @ (columns - u)), 0.01 * part.sum())
                    self.assertLess(abs(part.sum(1) @ (rows - v)), 0.01 * part.sum())


class Independent(unittest.TestCase):
    def measure(self, loads, camera, pixel_format, model):
        """For each load what was published while it was whole: ([Field], [Markers])."""
        up = [(step + 1) / RAMP for step in range(RAMP)]
        plan = REST * [(None, 0)]
        plan += [(name, share) for name in loads for share in up + HOLD * [1] + up[-2::-1] + [0]]
        noise = np.random.default_rng(1)

        @functools.cache
        def levels(name, share):
            moved = share * loads[name].displacement if share else 0
            return independent.picture(camera, camera.project(independent.markers() + moved))

        with rig.Rig() as bench:
            pictures, gel = bench.folder / "pictures.raw", bench.folder / "gel.toml"
            gel.write_text(camera.gel_file())
            with open(pictures, "wb") as file:
                for name, share in plan:
                    file.write(independent.frame(levels(name, share), pixel_format, noise))
            twin = bench.twin("idle", "--images", pictures, "--format", pixel_format, "--rate", 20)
            daemon = bench.daemon(f'[sensor]\ngel_file = "{gel}"\n[solve]\nmodel = "{model}"\n')
            subscribers = {kind: bench.subscribe(daemon) for kind in ("field", "markers")}
            published = [subscriber.collect(len(plan), kind) for kind, subscriber in subscribers.items()]
            for process in daemon, twin:
                self.assertEqual(process.stop(), 0, process.output())
            image = {frame: record["image"] for frame, record in rig.read_truth(twin).items()}
        return {name: [[message for message in messages if plan[image[message.header.camera_frame_id]] == (name, 1)]
                       for messages in published] for name in loads}

    def check_markers(self, camera, load, markers):
        """Each marker by its own number: u to the right, v down."""
        self.assertTrue(all(set(message.marker_valid) == {1} for message in markers))
        found = np.mean([message.displacement_px for message in markers], axis=0).reshape(2, -1, 2)
        rest = independent.markers()
        true = camera.project(rest + load.displacement) - camera.project(rest)
        print(np.sqrt(((found-true)**2).mean()), abs(found-true).max(), np.sqrt((true**2).mean()), abs(true).max(), np.sqrt((found**2).mean()))

    def check_forces(self, load, fields, tolerance, centre_tolerance_m):
        self.assertTrue(all(field.valid for field in fields))
        force = np.mean([rig.vector(field.resultant_N) for field in fields], axis=0)
        moment = np.mean([rig.vector(field.moment_Nm) for field in fields], axis=0)
        true_moment = np.cross((*load.place, 0), load.force) + (0, 0, load.torque)
        print(force, load.force, moment, true_moment)
        if load.force[2]:
            centre = [(field.centre_of_pressure_m.x, field.centre_of_pressure_m.y) for field in fields]
            print(np.mean(centre, axis=0), load.place)

    def check(self, loads, camera, pixel_format, model, *tolerances):
        print(camera is STRAIGHT, pixel_format, model)
        for name, (fields, markers) in self.measure(loads, camera, pixel_format, model).items():
            with self.subTest(name):
                self.assertGreaterEqual(min(len(fields), len(markers)), HOLD // 2)
                self.check_markers(camera, loads[name], markers)
                self.check_forces(loads[name], fields, *tolerances)

    def test_half_space_rgb8(self):
        self.check(half_space(), STRAIGHT, "RGB8", "half-space", 0.03, 0.001)

    def test_half_space_bayer_camera_askew_behind_a_window(self):
        self.check(half_space(), ASKEW, "BayerGR8", "half-space", 0.03, 0.001)

    def test_half_space_rgb_camera_askew_behind_a_window(self):
        self.check(half_space(), ASKEW, "RGB8", "half-space", 0.03, 0.001)

    def test_block_by_finite_elements(self):
        self.check(block(), STRAIGHT, "RGB8", "block", 0.03, 0.001)

    def test_half_space_read_by_the_block(self):
        self.check(half_space(), STRAIGHT, "RGB8", "block", 0.5, 0.006)


if __name__ == "__main__":
    unittest.main()

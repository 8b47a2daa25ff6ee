"""Signs, mirrors, places and the sense of torsion through the daemon, from pictures that none of our programs drew."""

import collections
import functools

import numpy as np

import independent
import rig

REST, RAMP, HOLD = 45, 3, 12  # frames
STRAIGHT = independent.Camera()
ASKEW = independent.Camera(aspect=1.035, position_mm=(2.0, -1.0, 178.0), rotation_rad=(0.012, -0.02, 0.05), k1=-0.15, k2=0.05,
                           principal_px=(335.0, 258.0), gel_index=1.41, window_index=1.49, window_thickness_mm=10.0)
# What is pressed where: [m], [N], [N m], and the markers' displacement [m].
Load = collections.namedtuple("Load", "place force torque displacement")


@functools.cache
def half_space():
    """Magnitudes and places differ, so that every mirror shows."""
    contacts = {"press": ((0.012, 0.006), 0.004, (0, 0, 4), 0), "shear x": ((-0.006, 0.003), 0.006, (2, 0, 0), 0),
                "shear y": ((0.003, -0.009), 0.006, (0, 1.5, 0), 0), "torsion": ((0, 0), 0.010, (0, 0, 0), 0.03)}
    return {name: Load(place, force, torque, independent.contact(place, radius, force, torque))
            for name, (place, radius, force, torque) in contacts.items()}


@functools.cache
def block():
    """Finite elements instead of our block; a shear along y by mirroring gel and markers in their diagonal."""
    path = rig.SOURCE / "tests" / "golden" / "block_reference.csv"
    press, shear = (independent.finite_elements(path, case) for case in "AB")
    mirrored = shear.reshape(2, 24, 24, 3).swapaxes(1, 2)[..., [1, 0, 2]].reshape(shear.shape)
    return {"press": Load((0.0007, 0.0004), (0, 0, 4), 0, 4 * press),
            "shear x": Load((0.0007, 0.0004), (2, 0, 0), 0, 2 * shear),
            "shear y": Load((0.0004, 0.0007), (0, 1.5, 0), 0, 1.5 * mirrored)}


@functools.cache
def levels(loads, name, share, camera):
    """Returns the noiseless picture of a share of one of the loads; it is the same in several tests."""
    moved = share * loads()[name].displacement if share else 0
    return independent.picture(camera, camera.project(independent.MARKERS + moved))


class Independent(rig.TestCase):
    def measure(self, loads, names, camera, pixel_format, model):
        """Returns for each load what was published while it was whole: ([Field], [Markers])."""
        up = [(step + 1) / RAMP for step in range(RAMP)]
        plan = REST * [(None, 0)]
        plan += [(name, share) for name in names for share in up + HOLD * [1] + up[-2::-1] + [0]]
        noise = np.random.default_rng(1)

        pictures, gel = self.bench.folder / "pictures.raw", self.bench.folder / "gel.toml"
        gel.write_text(camera.gel_file())
        with open(pictures, "wb") as file:
            for name, share in plan:
                file.write(independent.frame(levels(loads, name, share, camera), pixel_format, noise))
        with open(pictures, "rb") as source:
            film = self.bench.feed(source, len(plan), REST, f'[sensor]\ngel_file = "{gel}"\n[solve]\nmodel = "{model}"\n',
                                   pixel_format)
        return {name: [[message for message in messages if plan[message.header.camera_frame_id - 1] == (name, 1)]
                       for messages in (film.fields, film.markers)] for name in names}

    def check_markers(self, camera, load, markers, tolerance_px):
        """Each marker by its own number: u to the right, v down."""
        self.assertTrue(all(set(message.marker_valid) == {1} for message in markers))
        found = np.mean([message.displacement_px for message in markers], axis=0).reshape(2, -1, 2)
        true = camera.project(independent.MARKERS + load.displacement) - camera.project(independent.MARKERS)
        self.assertLess(abs(found - true).max(), tolerance_px)

    def check_forces(self, load, fields, tolerance_N, tolerance_Nm, tolerance_m):
        self.assertTrue(all(field.valid for field in fields))
        true_moment = np.cross((*load.place, 0), load.force) + (0, 0, load.torque)
        force = np.mean([rig.vector(field.resultant_N) for field in fields], axis=0)
        moment = np.mean([rig.vector(field.moment_Nm) for field in fields], axis=0)
        self.assertLess(abs(force - load.force).max(), tolerance_N, f"{force} for {load.force}")
        self.assertLess(abs(moment - true_moment).max(), tolerance_Nm, f"{moment} for {true_moment}")
        if load.force[2] > 0:
            centre = np.mean([(field.centre_of_pressure_m.x, field.centre_of_pressure_m.y) for field in fields], axis=0)
            self.assertLess(np.linalg.norm(centre - load.place), tolerance_m, f"{centre} for {load.place}")

    def check(self, loads, camera, pixel_format, model, tolerance_px, *tolerances):
        measured = self.measure(loads, loads(), camera, pixel_format, model)
        for name, (fields, markers) in measured.items():
            with self.subTest(name):
                self.assertEqual((len(fields), len(markers)), (HOLD + 1, HOLD + 1))  # the last of the ramp is the whole load
                self.check_markers(camera, loads()[name], markers, tolerance_px)
                self.check_forces(loads()[name], fields, *tolerances)

    # Forces are 1.5 to 4 N, moments 0.005 to 0.05 N m.

    def test_half_space_camera_askew_behind_lens_and_window(self):
        self.check(half_space, ASKEW, "RGB8", "half-space", 0.04, 0.08, 0.0015, 0.001)

    def test_half_space_bayer(self):
        self.check(half_space, STRAIGHT, "BayerGR8", "half-space", 0.1, 0.12, 0.003, 0.001)

    def test_block_by_finite_elements(self):
        self.check(block, STRAIGHT, "RGB8", "block", 0.04, 0.08, 0.0015, 0.001)

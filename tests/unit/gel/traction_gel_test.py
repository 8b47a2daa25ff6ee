"""traction-gel: its mechanics against the daemon's block, shapes against each other, and what it says to wrong input."""

import contextlib
import io
import itertools
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import tomllib
import types
import unittest
import unittest.mock

import gmsh
import numpy as np
import scipy.sparse
import scipy.spatial
import suite
from traction_gel import check, cli, files, geometry, influence, mechanics, mesh, mould, placement, triangles
from traction_gel.problem import Problem

BIN = pathlib.Path(os.environ["TRACTION_BUILD"]) / "bin"
SHIPPED = pathlib.Path(__file__).resolve().parents[3] / "gel" / "fingertip.toml"
YOUNG = 180000
OCTAHEDRON = np.array([np.diag(signs)[:: np.prod(signs)] for signs in itertools.product((1, -1), repeat=3)], float)  # 8 triangles
SKIN = {"skin_mm": 0.5, "youngs_modulus_pa": 5 * YOUNG, "poisson_ratio": 0.45}


def fingertip(**tables):
    """The shipped fingertip with fewer and deeper markers, and other tables; small enough for seconds."""
    task = tomllib.loads(SHIPPED.read_text())
    task["error_percent"] = 20
    task["layers"][0] |= {"columns": 5, "rows": 4, "pitch_mm": 1.5}
    task["nodes"] |= {"columns": 3, "rows": 4, "pitch_mm": 2}
    task["deviations"] = {"bone_mm": [0, 0, 0]}
    return tables | {name: table | tables.get(name, {}) if isinstance(table, dict) else tables.get(name, table)
                     for name, table in task.items()}


def block(count, error):
    grid = {"columns": count, "rows": count, "pitch_mm": 3}
    return {
        "shape": {"kind": "block", "width_mm": 60, "height_mm": 60, "thickness_mm": 20},
        "material": {"youngs_modulus_pa": YOUNG, "poisson_ratio": 0.49},
        "layers": [grid | {"colour": "blue", "depth_mm": 6, "diameter_mm": 0.6},
                   grid | {"colour": "red", "depth_mm": 8, "diameter_mm": 0.6, "centre_mm": [1.5, 1.5]}],
        "nodes": grid, "camera": files.CAMERA, "error_percent": error,
    }


def quiet(*_):
    pass


class Block(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def errors(self, task):
        """The largest error of a marker's displacement for each node and axis, as a part of the largest displacement."""
        found = influence.compute(task, ".", quiet)
        part = 3e-3 * ((np.arange(placement.SAMPLES) + 0.5) / placement.SAMPLES - 0.5)
        count = placement.SAMPLES**2
        rows = [[3 * node + axis, 1e-3 * x + a, 1e-3 * y + b, *np.eye(3)[axis] / count]
                for node, (x, y, _) in enumerate(found.nodes) for axis in range(3) for a in part for b in part]
        np.array(rows).tofile(self.folder / "forces.f64")
        gel = 'format = 1\n[gel]\nwidth_mm = 60\nheight_mm = 60\nthickness_mm = 20\n'
        for layer in task["layers"]:
            gel += "[[layers]]\n" + "".join(f"{key} = {files._toml(value)}\n" for key, value in layer.items())
        gel += "[nodes]\n" + "".join(f"{key} = {value}\n" for key, value in task["nodes"].items())
        (self.folder / "gel.toml").write_text(gel)
        subprocess.run([BIN / "evaluation_parts", "mechanics", self.folder, self.folder / "gel.toml"], check=True)
        true = np.fromfile(self.folder / "displacement.f64").reshape(3 * len(found.nodes), -1, 3)
        own = found.influence.transpose(2, 3, 0, 1).reshape(true.shape)
        off = np.linalg.norm(own - true, axis=2).max(1) / np.linalg.norm(true, axis=2).max(1)
        return off.max(), found.error_percent / 100

    def test_is_that_of_the_daemon_within_the_estimated_error(self):
        error, estimated = self.errors(block(3, 4))
        self.assertLess(error, estimated)

    @suite.minutes
    def test_skins_of_the_same_material_change_nothing(self):
        alike = block(3, 4)["material"]
        error, estimated = self.errors(block(3, 4) | {"materials": [alike | {"skin_mm": 3}, alike | {"skin_mm": 4}]})
        self.assertLess(error, estimated)  # the red markers are in the core, the blue ones in the second skin



class Fingertip(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def write(self, task):
        """A description; returns its path."""
        text = "".join(f"{key} = {files._toml(value)}\n" for key, value in task.items() if not isinstance(value, (dict, list)))
        for name, tables in task.items():
            for table in tables if isinstance(tables, list) else [tables] if isinstance(tables, dict) else []:
                text += f"[[{name}]]\n" if isinstance(tables, list) else f"[{name}]\n"
                text += "".join(f"{key} = {files._toml(value)}\n" for key, value in table.items())
        path = self.folder / "tip.toml"
        path.write_text(text)
        return path

    def run_program(self, task, *words):
        return subprocess.run([BIN / "traction-gel", "mesh", self.write(task), *words], cwd=self.folder,
                              text=True, capture_output=True, timeout=300)

    def test_the_daemon_takes_what_is_written(self):
        done = self.run_program(fingertip())
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({path.name for path in self.folder.iterdir()}, {"tip.toml", "tip.npz", "tip_gel.toml", "tip.png"})
        (self.folder / "config.toml").write_text(f'[sensor]\ngel_file = "{self.folder / "tip_gel.toml"}"\n')
        checked = subprocess.run([BIN / "tractiond", "--check-config", "--config", self.folder / "config.toml"],
                                 capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        with np.load(self.folder / "tip.npz") as file:
            centre = np.array([0, 0, 10e-3])
            np.testing.assert_allclose(file["node_normals"], (centre - file["node_positions"]) / 10e-3, atol=0.01)
            np.testing.assert_allclose(np.linalg.norm(file["marker_positions"] - centre, axis=1), 8e-3, atol=2e-5)
            self.assertTrue((np.diff(file["marker_positions"][:5, 0]) > 0).all())  # columns along +x

    def test_both_ways_of_reciprocity_agree(self):
        task = fingertip()
        with mesh.Body(task["shape"], ".", [{"skin_mm": 0.8}]) as body:
            corners, free, _, _ = body.surface(1.0)
            surface = placement.Surface(corners, free)
            _, _, _, points, weights = placement.nodes(surface, task["nodes"])
            markers = placement.markers(surface, task["layers"])[0]
            gel = mechanics.Gel(body.elements(2.0, markers), [(1, 0.49), (5, 0.4)])
        by_nodes = gel.influence(markers, points, weights)
        by_markers = np.concatenate([gel.influence(part, points, weights) for part in np.array_split(markers, 2)])
        np.testing.assert_allclose(by_markers, by_nodes, atol=1e-9 * abs(by_nodes).max())
        gel.left_to_elements = lambda markers: np.ones(len(markers), bool)
        for part in (markers, markers[:3]):  # by nodes, by markers
            plain = gel.influence(part, points, weights)
            np.testing.assert_allclose(plain, by_nodes[: len(part)], atol=0.04 * abs(by_nodes).max())

    def write_step(self, name, *parts):
        """\\param parts of each: the radius of a hemisphere on a cylinder, and how far it is moved along x; or a function that
        makes other solids"""
        with mesh.session():
            occ = gmsh.model.occ
            for part in parts:
                if callable(part):
                    part(occ)
                    continue
                radius, x = part
                whole, _ = occ.fuse([(3, occ.addSphere(0, 0, 10, radius))], [(3, occ.addCylinder(0, 0, 10, 0, 0, 18, radius))])
                solid, _ = occ.intersect(whole, [(3, occ.addBox(-20, -20, -1, 40, 40, 19))])
                occ.translate(solid, x, 0, 0)
            occ.synchronize()
            with mould.silent():
                gmsh.write(str(self.folder / f"{name}.step"))

    def contact(self, shape, materials=()):
        """Makes the gel's surface. Returns what is said of its contact with the bone and between materials."""
        said = []
        with mesh.Body(shape, self.folder, materials) as body:
            corners, free, bonded, between = body.surface(0.8)
            placement.check_bonded(corners, free, body.sides, bonded, between, shape.get("bonded_percent", 99.8), lambda text, again: said.append(text))
        return said

    def test_files_of_cad_are_the_built_in_shape(self):
        for name, radius in (("gel", 10), ("core", 9), ("bone", 6), ("far", 1)):
            self.write_step(name, (radius, 40 * (name == "far")))
        files_of_cad = {"gel_file": "gel.step", "bone_file": "bone.step"}
        for cad, built_in in (([], []), ([{"gel_file": "core.step"}], [{"skin_mm": 1}])):
            areas = []
            for shape, materials in ((files_of_cad, cad), (fingertip()["shape"], built_in)):
                with mesh.Body(shape, self.folder, materials) as body:
                    corners, *surfaces = body.surface(0.8)
                sides = [corners[faces[:, 1:]] - corners[faces[:, :1]] for faces in surfaces]
                areas.append([np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1).sum() / 2 for side in sides])
            np.testing.assert_allclose(*areas, rtol=0.005)  # free, bonded, between materials
            self.assertEqual(areas[0][2] > 0, bool(cad))
        apart = mesh.Body(files_of_cad, self.folder, [{"gel_file": "far.step"}])
        with self.assertRaisesRegex(Problem, "touches no other"), apart:
            pass
        done = self.run_program(fingertip() | {"shape": {"gel_file": "gel.step"}})
        self.assertEqual(done.returncode, 65)
        self.assertIn("no part of the gel is bonded", done.stderr)

    def test_a_second_solid_is_refused_with_its_size_and_place(self):
        self.write_step("bone", (6, 0))
        gel, ball = (10, 0), lambda *place: lambda occ: occ.addSphere(*place, 1)  # noqa: E731
        for name, parts, said in (("assembly", (gel, (6, 0)), r"has 2 solids, and not 1: .*12 x 12 x 14 mm about \(0, 0, 11\)"),
                                  ("crumb", (gel, ball(30, 0, 12)), r"2 solids.*2 x 2 x 2 mm about \(30, 0, 12\)"),
                                  ("overlap", (gel, ball(10, 0, 12)), r"2 solids.*2 x 2 x 2 mm about \(10, 0, 12\)"),
                                  ("face", (gel, lambda occ: occ.addRectangle(20, 0, 0, 1, 1)), "1 faces that bound no solid")):
            self.write_step(name, *parts)
            with self.subTest(name), self.assertRaisesRegex(Problem, said):
                self.contact({"gel_file": f"{name}.step", "bone_file": "bone.step"})
            print(f"\n  a STEP file of the gel and another part ({name}): refused with its place; right: refused", end="")

    def test_a_gap_to_the_bone_is_measured_and_refused(self):
        print()
        self.write_step("gel", lambda occ: occ.cut([(3, self.finger(occ, 10, 0))], [(3, self.finger(occ, 6, 0))]))
        shape = {"gel_file": "gel.step", "bone_file": "bone.step"}
        for gap in (0.01, 0.1, 0.5):
            self.write_step("bone", lambda occ, gap=gap: self.finger(occ, 6, gap))
            with self.assertRaises(Problem) as raised:
                self.contact(shape)
            found = re.match(r"(\S+) mm² .*, (\S+) % of what looks at the bone; gaps are up to (\S+) mm wide, there at \((.*)\)", str(raised.exception))
            area, share, widest = map(float, found.groups()[:3])
            print(f"  bone {gap:g} mm short of its cavity's floor: refused, {share:g} % in contact, gap {widest:.2g} mm; right: refused, 57 %")
            self.assertAlmostEqual(area, 2 * np.pi * 6 * (8 - gap), delta=3)  # the cylinder's wall
            self.assertAlmostEqual(share, 100 * (8 - gap) / 14, delta=1)
            self.assertAlmostEqual(widest, gap, delta=0.02)
        self.write_step("bone", (6, 0))
        self.assertRegex(self.contact(shape)[0], r"52\d.* mm² of the gel are bonded, 100\.0 %")
        self.contact({"gel_file": "gel.step", "bone_file": "bone.step", "bonded_percent": 50})

    @staticmethod
    def finger(occ, radius, top):
        """A hemisphere of which the lowest point is at z = 10 - radius + top, on a cylinder up to z = 18. Returns its tag."""
        ball = occ.addSphere(0, 0, 10 + top, radius)
        whole, _ = occ.fuse([(3, ball)], [(3, occ.addCylinder(0, 0, 10 + top, 0, 0, 20, radius))])
        return occ.intersect(whole, [(3, occ.addBox(-20, -20, -1, 40, 40, 19))])[0][0][1]

    def test_materials_overlap_by_any_thickness(self):
        self.write_step("bone", (6, 0))
        self.write_step("skin", lambda occ: occ.cut([(3, self.finger(occ, 10, 0))], [(3, self.finger(occ, 9, 0))]))
        shape, found = {"gel_file": "core.step", "bone_file": "bone.step"}, []
        for more in (0, 0.01, 0.02, 0.05, 0.1):
            self.write_step("core", (9 + more, 0))
            self.assertRegex(self.contact(shape, [{"gel_file": "skin.step"}])[1], "are in contact, 100.0 %")
            with mesh.Body(shape, self.folder, [{"gel_file": "skin.step"}]) as body:
                elements = body.elements(1.0, np.array([[0, 0, 2.0]]))
                volumes = elements.convex_area()
                found.append([volumes[elements.region(10 + part)[0]].sum() for part in (0, 1)])
            print(f"\n  skin and core overlap by {more:g} mm: {found[-1][0]:.0f} and {found[-1][1]:.0f} mm³; right: 2205 and 1045", end="")
        np.testing.assert_allclose(found, [[2205, 1045]] * 5, rtol=0.01)
        self.write_step("core", (8.99, 0))
        with self.assertRaisesRegex(Problem, "2 bodies of which one touches no other"):
            self.contact(shape, [{"gel_file": "skin.step"}])

    def test_too_many_elements_are_refused_before_they_are_made(self):
        task = fingertip()
        places = np.random.default_rng(4).uniform([-3, -3, 1], [3, 3, 3], (50, 3))
        with mesh.Body(task["shape"], ".") as body:
            body.surface(1.0)
            expected = body.expected(1.0, places, 1e6)
            self.assertGreater(body.expected(0.01, places, 1e4), 1e4)
            self.assertLess(abs(np.log2(expected / body.elements(1.0, places).nbcvs())), 1)
        self.enterContext(unittest.mock.patch.object(mesh.Body, "elements", side_effect=AssertionError))
        flat = [[x, y] for y in (-1, 0, 1, 2) for x in (-1, 0, 1, 2)]
        shallow = [[x, y, 0.02 + 10 - math.sqrt(100 - x**2 - y**2)] for x, y in flat]
        metres = [[1e-3 * x, 1e-3 * y, 2e-3] for x, y in flat]
        for places, said in ((shallow, r"a marker is 0\.0[12]\d* mm below .* elements of 0\.0\d+ mm: at least \d+ of them"),
                             (metres, "they seem to be in metres")):
            layer = task["layers"][0] | {"columns": 4, "positions_mm": places}
            with self.subTest(said), self.assertRaisesRegex(Problem, said) as raised:
                influence.compute(task | {"layers": [layer]}, self.folder, quiet)
            print(f"\n  markers {places[5][2]:g} mm deep at (0, 0): {str(raised.exception)[:90]}...; right: refused before meshing", end="")

    def test_files_that_are_no_shape_are_not_run_and_end_in_a_sentence(self):
        names = "gel.Stl", "gel.stl", "gel.step", "gel.STEP", "gel.geo", "gel.Brep", "gel.msh", "gel.geo_unrolled", "gel.igs", "gel"
        for name, head in itertools.product(names, ("", "ISO-10303-21;\n", "DBRep_DrawableShape\n", "solid\n")):
            script = f'{head}System "touch {self.folder}/ran";\nSystemCall "touch {self.folder}/ran";\nMerge "script.geo";\n'
            for file in (name, "script.geo"):
                (self.folder / file).write_text(script)
            with self.subTest(name, head=head), self.assertRaisesRegex(Problem, f"shape.gel_file: {self.folder / name}"):
                influence.compute(fingertip() | {"shape": {"gel_file": name, "bone_file": name}}, self.folder, quiet)
        done = self.run_program(fingertip() | {"shape": {"gel_file": names[0]}})
        self.assertEqual((done.returncode, done.stderr.count("\n")), (65, 1), done.stderr)
        self.assertFalse((self.folder / "ran").exists())
        print(f"\n  {4 * len(names)} scripts under names of shapes: each refused by name, none has run; right: none runs", end=" ")

    def test_what_a_library_throws_ends_in_a_sentence(self):
        errors = io.StringIO()
        with unittest.mock.patch.object(influence, "compute", side_effect=ValueError("zero-size\narray")), \
                contextlib.redirect_stderr(errors):
            self.assertEqual(cli.main("1", ["mesh", str(self.write(fingertip()))]), 70)
        self.assertRegex(errors.getvalue(), r"^traction-gel: unexpected: zero-size array \(ValueError in .*\n$")

    def test_a_file_of_any_windows_editor_is_read_or_refused_by_its_encoding(self):
        for text in (SHIPPED.read_text(encoding="utf-8").encode("utf-8-sig"), SHIPPED.read_bytes().replace(b"\n", b"\r\n")):
            (self.folder / "marked.toml").write_bytes(text)
            self.assertEqual(files.read(self.folder / "marked.toml")["shape"], files.read(SHIPPED)["shape"])
        (self.folder / "wide.toml").write_bytes(SHIPPED.read_text(encoding="utf-8").encode("utf-16"))
        with self.assertRaisesRegex(Problem, "wide.toml has bytes that are 0, as in UTF-16 .*: save it as UTF-8"):
            files.read(self.folder / "wide.toml")

    def test_wrong_input_is_refused_with_what_is_wrong(self):
        for tables, said in (
            ({"material": {"poisson_ratio": 0.5}}, "poisson_ratio"),
            ({"shape": {"gel_mm": 12}}, "shape.gel_mm"),
            ({"camera": {"position_mm": [0, 0]}}, "camera.position_mm"),
            ({"nodes": {"columns": 2.5}}, "nodes.columns"),
            ({"shape": {"diameter_mm": 0.02, "gel_mm": 0.004, "length_mm": 0.01}}, "metres and millimetres"),
            ({"nodes": {"pitch_mm": 12}}, "nodes: row 0, column 0"),
            ({"camera": {"focal_px": 8000}}, "layers[0]: marker in row 0, column 0"),
            ({"materials": [SKIN | {"poisson_ratio": 0.5}]}, "materials[0].poisson_ratio"),
            ({"materials": [SKIN, SKIN | {"skin_mm": 3.6}]}, "materials[1].skin_mm"),
            ({"materials": [SKIN | {"gel_file": "skin.step"}]}, "materials[0] must have skin_mm"),
            ({"shape": {"gel_file": 3}}, "shape.gel_file is 3"),
            ({"shape": {"kind": [1]}}, "shape.kind is [1]"),
            ({"shape": {"cavities": 0.5}}, "shape.cavities"),
            ({"deviations": {"youngs_modulus_relative": [0.1]}}, "deviations.youngs_modulus_relative"),
        ):
            with self.subTest(said), self.assertRaises(Problem) as raised:
                influence.compute(files.read(self.write(fingertip(**tables))), self.folder, quiet)
            self.assertIn(said, str(raised.exception))
        for depth, said in ((4.5, "inside the bone"), (-0.5, "outside the gel")):
            place = {"positions_mm": [[0, 0, depth]] * 16, "columns": 4, "rows": 4, "diameter_mm": 0.3}
            with self.subTest(said), self.assertRaises(Problem) as raised:
                influence.compute(files.read(self.write(fingertip() | {"layers": [place]})), self.folder, quiet)
            self.assertRegex(str(raised.exception), rf"marker in row 0, column 0 at .*{said}")

    def test_a_hole_is_told_with_its_place(self):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        with self.assertRaisesRegex(Problem, r"not closed: .* at \(0.5, 0, 0.5\) mm|not closed"):
            triangles.oriented(corners, np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3]]))

    def write_stl(self, size, change=lambda parts: parts):
        """gel.stl and bone.stl of the shipped fingertip, in triangles of this size. \\param change makes other triangles, T x
        3 x 3 [mm], of the gel's"""
        task = fingertip()["shape"]
        with mesh.Body(task, ".") as body:
            corners, free, bonded, _ = body.surface(size)
        parts = {"gel": change(corners[np.concatenate([free, bonded])])}
        with mesh.Body(task | {"diameter_mm": 12, "gel_mm": 3}, ".") as body:
            corners, free, bonded, _ = body.surface(size)
        parts["bone"] = corners[free] + [0, 0, 4]  # the outside of a shell that is as large as the bone
        for name, triangles_mm in parts.items():
            text = "".join("facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in part)
                           + "endloop\nendfacet\n" for part in triangles_mm)
            (self.folder / f"{name}.stl").write_text(f"solid {name}\n{text}endsolid {name}\n")

    def test_triangles_are_the_built_in_shape(self):
        self.write_stl(0.7)
        areas, stl = [], {"gel_file": "gel.stl", "bone_file": "bone.stl"}
        for shape in (stl, fingertip()["shape"]):
            with mesh.Body(shape, self.folder) as body:
                corners, *surfaces, _ = body.surface(0.8)
            sides = [corners[faces[:, 1:]] - corners[faces[:, :1]] for faces in surfaces]
            areas.append([np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1).sum() / 2 for side in sides])
        np.testing.assert_allclose(*areas, rtol=0.01)  # free, bonded

    def test_what_is_wrong_with_triangles_is_told_with_the_face(self):
        def without(parts):
            return np.delete(parts, 100, axis=0)

        def crossed(parts):
            return np.concatenate([parts, parts + [1, 1, 1]])

        def in_metres(parts):
            return 1e-3 * parts

        def with_body(x, turned=slice(None), some=slice(None)):
            def change(parts):
                body = OCTAHEDRON + [x, 0, 12]
                body[some] = body[some, turned]
                return np.concatenate([parts, body])

            return change

        inwards = slice(None, None, -1)
        for change, said in ((with_body(8), r"2 closed surfaces: the gel, 20 x .*; another body, 2 x 2 x 2 mm about \(8, 0, 12\)"),
                             (with_body(30), r"another body, 2 x 2 x 2 mm about \(30, 0, 12\)"),
                             (with_body(30, inwards), "a cavity outside the gel, 2 x"),
                             (with_body(8, inwards, 3), "triangles turned both ways, 2 x"),
                             (with_body(8, inwards), r"1 closed cavities without a bone, .* 2 x 2 x 2 mm about \(8, 0, 12\)"),
                             (without, r"not closed: 1 faces meet at .* mm, and not 2; one is face \d+"),
                             (crossed, r"faces \d+ and \d+ pass through each other near \("),
                             (in_metres, "metres and millimetres were confused")):
            self.write_stl(1.5, change)
            shape = {"gel_file": "gel.stl", "bone_file": "bone.stl"}
            with self.subTest(said), self.assertRaisesRegex(Problem, said) as raised, mesh.Body(shape, self.folder):
                pass
            print(f"\n  STL file: {str(raised.exception)[:110]}...; right: refused", end="")

    def test_a_cavity_that_is_named_is_one(self):
        for count in (0, 1):
            self.write_stl(1.5, lambda parts, count=count: np.concatenate([parts, *[1.5 * OCTAHEDRON[:, ::-1] + [8, 0, 12]] * count]))
            with mesh.Body({"gel_file": "gel.stl", "bone_file": "bone.stl", "cavities": count}, self.folder) as body:
                corners, free, bonded, _ = body.surface(1.0)
                inside = geometry.turns(np.array([[8, 0, 12], [-8, 0, 12.0]]), corners, np.concatenate([free, bonded]))
                np.testing.assert_allclose(inside, [1 - count, 1], atol=1e-6)
                self.assertGreater(body.elements(1.0, np.array([[0, 0, 2.0]])).nbcvs(), 1000)

    @suite.minutes
    def test_an_error_of_the_bones_place_is_what_another_bone_does(self):
        found = influence.compute(fingertip(error_percent=3, deviations={"bone_mm": [0, 0, 0.2]}), ".", quiet)
        self.assertEqual(len(found.errors), 1)
        # The middle of the hemisphere has a gel 0.2 mm thicker above its bone, as a hemisphere of 4.2 mm has it.
        thicker = influence.compute(fingertip(error_percent=3, shape={"gel_mm": 4.2}), ".", quiet).influence
        middle = np.argsort(np.linalg.norm(found.nodes[:, :2], axis=1))[:2]
        one, two = (field[:, :, middle, 2][:, 2] for field in (found.errors[0], thicker - found.influence))
        np.testing.assert_allclose(one, two, atol=0.25 * abs(two).max())

    @suite.minutes
    def test_an_error_of_a_skins_modulus_is_what_another_skin_does(self):
        task = fingertip(error_percent=5) | {"materials": [SKIN]}
        found = influence.compute(task | {"deviations": {"youngs_modulus_relative": [0.2]}}, ".", quiet)
        self.assertEqual(len(found.errors), 1)
        stiff = SKIN | {"youngs_modulus_pa": 1.2 * SKIN["youngs_modulus_pa"]}
        stiffer = influence.compute(task | {"materials": [stiff]}, ".", quiet)
        change = stiffer.influence - found.influence
        np.testing.assert_allclose(found.errors[0], change, atol=0.15 * abs(change).max())
        self.assertGreater(abs(change).max(), 0.02 * abs(found.influence).max())

    @suite.minutes  # and not every Debian has CalculiX
    @unittest.skipUnless(shutil.which("ccx"), "needs calculix-ccx")
    def test_calculix_confirms_a_gel_with_a_skin_and_no_wrong_one(self):
        skin = SKIN | {"skin_mm": 1}
        task = fingertip(error_percent=5, nodes={"columns": 1, "rows": 1}) | {"materials": [skin]}
        task["shape"] = {"kind": "dome", "diameter_mm": 14, "height_mm": 6}
        result = influence.compute(task, ".", quiet)
        said, known, by_calculix = [], {}, check._by_calculix

        def once(task, result, chosen, size, folder):
            if size not in known:
                known[size] = by_calculix(task, result, chosen, size, folder)
            return known[size]

        self.enterContext(unittest.mock.patch.object(check, "_by_calculix", once))
        check.check(task, result, ".", lambda text, again: said.append(text))
        self.assertRegex(said[-1], r"row 0, column 0: displacements differ by \d.*, largest \d")
        alike = influence.compute(task | {"materials": [skin | {"youngs_modulus_pa": 2.5 * YOUNG}]}, ".", quiet)
        result.influence = alike.influence
        with self.assertRaisesRegex(Problem, "CalculiX differs by"):
            check.check(task, result, ".", quiet)

    def check_by(self, *errors, asked=1):
        """The check of two nodes' displacements by a CalculiX that errs by these parts of the peak, mesh after mesh. Returns what
        is said, and the sizes of its meshes."""
        true = np.random.default_rng(3).normal(size=(2, 3, 5, 3))
        result = types.SimpleNamespace(weights=scipy.sparse.eye(2, format="csr"), influence=true.transpose(2, 3, 0, 1), size=1)
        meshes, sizes, said = iter(errors), [], []

        def found(task, result, chosen, size, folder):
            sizes.append(size)
            return true * (1 + next(meshes)), 10000 * len(sizes)

        with unittest.mock.patch.object(check, "_by_calculix", found):
            check.check({"error_percent": asked, "nodes": {"columns": 1}}, result, ".", lambda text, again: said.append(text))
        return said, sizes

    def test_calculix_is_believed_when_its_displacements_stay(self):
        said, sizes = self.check_by(0.03, 0.009, 0.006, 0.1)  # the first is beyond what is asked for
        np.testing.assert_allclose(np.divide(sizes[1:], sizes[:-1]), check.FINER)
        self.assertEqual(len(sizes), 3)
        self.assertRegex(said[2], r"those of the larger bricks by 0\.30 %")
        self.assertRegex(said[3], r"row 0, column 0: displacements differ by .* largest 0\.60 %")
        with self.assertRaisesRegex(Problem, r"CalculiX differs by 1\.\d+ % of the peak, and error_percent asks for 1"):
            self.check_by(0.03, 0.013, 0.0125)

    def test_a_calculix_whose_displacements_do_not_stay_cannot_tell(self):
        for most, said in ((10000, "has 10000 bricks"), (18000, r"changes displacements by 0\.69 %")):
            with unittest.mock.patch.object(check, "MOST_BRICKS", most), self.assertRaisesRegex(Problem, said):
                self.check_by(0.001, 0.008, 0.001, 0.001)

    def test_without_calculix_the_check_says_what_to_install(self):
        command = ["/usr/bin/python3", BIN / "traction-gel", "mesh", self.write(fingertip()), "--check"]
        done = subprocess.run(command, cwd=self.folder, text=True, capture_output=True,
                              env=os.environ | {"PATH": str(self.folder)})
        self.assertEqual(done.returncode, 65)
        self.assertIn("install calculix-ccx", done.stderr)

    def test_a_clear_bone_refracts_as_the_gel_file_says(self):
        def surfaces(**bone):
            return files.read(self.write(fingertip(bone=bone)))["camera"]["surfaces"]

        outside = {"centre_mm": [0.0, 0.0, 10.0], "radii_mm": [6.0, 6.0, 6.0], "index": 1.5}
        self.assertEqual(surfaces(index=1.5, gel_index=1.41), [outside, {"centre_mm": [0.0, 0.0, 26.0], "index": 1.0}])
        self.assertEqual(surfaces(index=1.5, gel_index=1.41, wall_mm=2), [outside, outside | {"radii_mm": [4.0] * 3, "index": 1.0}])
        for bone, said in (({"index": 1.5}, "bone.gel_index"), ({"index": 1.5, "gel_index": 1.41, "wall_mm": 6}, "bone.wall_mm"),
                           ({"index": 15, "gel_index": 1.41}, "bone.index")):
            with self.subTest(said), self.assertRaisesRegex(Problem, said):
                surfaces(**bone)

    def test_ctrl_c_leaves_nothing(self):
        path = self.write(fingertip(error_percent=0.02))
        temporary = self.folder / "temporary"
        temporary.mkdir()
        program = subprocess.Popen([BIN / "traction-gel", "mesh", path], cwd=self.folder, stderr=subprocess.PIPE, text=True,
                                   env=os.environ | {"TMPDIR": str(temporary)})
        self.assertIn("surface", program.stderr.readline())
        program.stderr.readline()
        program.send_signal(signal.SIGINT)
        self.assertIn(program.wait(120), (130, -signal.SIGINT))
        program.stderr.close()
        self.assertEqual(list(temporary.iterdir()), [])
        self.assertEqual({each.name for each in self.folder.iterdir()}, {"tip.toml", "temporary"})


class Mould(unittest.TestCase):
    """Of a description: what is written, read again."""

    SHAPES = {  # of each: the volumes of the gel, of what a cup has room for, and of the bone
        "hemisphere": ({"diameter_mm": 20, "length_mm": 8, "gel_mm": 4}, lambda r: 2 / 3 * np.pi * r**3 + 8 * np.pi * r**2, 10, 6),
        "ellipsoid": ({"width_mm": 18, "height_mm": 18, "length_mm": 9, "gel_mm": 3}, lambda r: 2 / 3 * np.pi * r**3, 9, 6),
        "dome": ({"diameter_mm": 20, "height_mm": 10}, lambda r: 2 / 3 * np.pi * r**3, 10, 0),
        "block": ({"width_mm": 20, "height_mm": 20, "thickness_mm": 8}, lambda _: 20 * 20 * 8, 0, None),
    }

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def task(self, kind, **tables):
        path = self.folder / "tip.toml"
        path.write_text(SHIPPED.read_text())
        return files.read(path) | {"shape": {"kind": kind} | self.SHAPES[kind][0]} | tables

    def volume_of(self, path):
        """Of what an STL file encloses; fails if it is not closed."""
        with mesh.session():
            corners, faces = triangles.read(path, path.name)
        a, b, c = corners[triangles.oriented(corners, faces)].transpose(1, 0, 2)
        return (a * np.cross(b, c)).sum() / 6

    def test_the_cavities_are_the_gel_and_its_inner_layers(self):
        self.check_cavities("hemisphere", "block")

    @suite.minutes
    def test_the_cavities_of_the_other_shapes_are_too(self):
        self.check_cavities("ellipsoid", "dome")

    def check_cavities(self, *kinds):
        for kind in kinds:
            _, solid, radius, bone = self.SHAPES[kind]
            with self.subTest(kind):
                task = self.task(kind)
                said = []
                mould.write(task, self.folder / kind, lambda text, again, said=said: said.append(text))
                drawing = mould.Drawing(task)
                pins = 2 * np.pi * (drawing.pin / 2)**2 * (drawing.lid + drawing.bridge)
                block = 4 * np.prod(drawing.half) * (drawing.form.end + drawing.wall) + pins
                room = block - self.volume_of(self.folder / f"{kind}_cup.stl")
                wanted = solid(radius)
                if bone:
                    self.assertIn(f"cup: {1e-3 * (wanted - solid(bone)):.2f} ml of gel", said)
                    inner = block - self.volume_of(self.folder / f"{kind}_cup_2mm.stl")
                    np.testing.assert_allclose(inner, solid(radius - 2), rtol=0.01)
                    np.testing.assert_allclose(room, wanted, rtol=0.01)
                else:
                    grooves = np.pi * (drawing.pour / 2)**2 * drawing.wall  # halves on both sides
                    np.testing.assert_allclose(room, wanted + grooves, rtol=0.01)
                    self.assertIn(f"cup: {1e-3 * wanted:.2f} ml of gel", said)

    def test_the_command_writes_each_part_and_prints_nothing_else(self):
        path = self.folder / "pad.toml"
        text = SHIPPED.read_text().replace('"hemisphere"', '"block"\nwidth_mm = 30\nheight_mm = 20\nthickness_mm = 6')
        path.write_text(text)
        done = subprocess.run([BIN / "traction-gel", "mould", path], cwd=self.folder, text=True, capture_output=True, timeout=300)
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
        names = {f"pad_{part}.{kind}" for part in ("window", "cup", "cup_2mm") for kind in ("step", "stl")}
        self.assertEqual({each.name for each in self.folder.iterdir()}, names | {"pad.toml", "pad_mould.png"})
        self.assertIn("cup: 3.60 ml of gel", done.stderr)

    def test_a_bone_sits_where_the_description_has_it(self):
        mould.write(self.task("hemisphere"), self.folder / "tip", quiet)
        with mesh.session():
            corners, _ = triangles.read(self.folder / "tip_bone.stl", "bone")
        hangs = corners[:, 2].max() - files.MOULD["bridge_mm"]
        self.assertAlmostEqual(hangs, 18 + files.MOULD["lid_mm"], 6)  # on the lid, which is on the cup's rim
        below = corners[corners[:, 2] < 10 - 1e-6]
        np.testing.assert_allclose(np.linalg.norm(below - [0, 0, 10], axis=1), 6, atol=1e-6)
        self.assertAlmostEqual(corners[:, 2].min(), 4, 2)

    def test_a_bone_with_a_wall_is_hollow_and_open_to_the_camera(self):
        with mould.session():
            volumes = [mould.volume(mould.Drawing(self.task("hemisphere", **bone)).bone()) for bone in ({}, {"bone": {"wall_mm": 2}})]
        np.testing.assert_allclose(volumes[0] - volumes[1], 2 / 3 * np.pi * 4**3 + np.pi * 4**2 * (26 - 10), rtol=0.01)

    def test_the_gel_comes_out_of_its_cup(self):
        for kind in self.SHAPES:
            with self.subTest(kind), mesh.session():
                drawing = mould.Drawing(self.task(kind))
                cup, gel = drawing.cup(0.0), drawing.form.solid(0.0)
                for _ in range(8):
                    gmsh.model.occ.translate(gel, 0, 0, drawing.form.end / 6)
                    self.assertLess(mould.common(cup, gel), 1e-3)

    def test_parts_that_do_not_fit_are_not_written(self):
        right = mould.Drawing.column
        for wrong, said in ((lambda self, low, high, more: right(self, low, high, more - 0.15 * (more > 0)), "bone and lid_half intersect"),
                            (lambda self, low, high, more: right(self, low - 5, high, more + 0.05), "the cavity of cup has")):
            with self.subTest(said), unittest.mock.patch.object(mould.Drawing, "column", wrong):
                with self.assertRaisesRegex(Problem, said):
                    mould.write(self.task("hemisphere"), self.folder / "tip", quiet)
        self.assertEqual({path.name for path in self.folder.iterdir()}, {"tip.toml"})

    def test_wrong_dimensions_are_refused(self):
        for tables, said in (({"mould": {"pour_mm": 5}}, "mould.pour_mm"), ({"mould": {"wall_mm": 0}}, "mould.wall_mm"),
                             ({"shape": {"gel_file": "gel.step"}}, "shape.gel_file")):
            path = self.folder / "tip.toml"
            text = SHIPPED.read_text()
            for name, table in tables.items():
                text = text.replace(f"[{name}]", f"[was_{name}]").replace("was_shape", "uncertainty")
                text += f"\n[{name}]\n" + "".join(f"{key} = {files._toml(value)}\n" for key, value in table.items())
            path.write_text(text)
            with self.subTest(said), self.assertRaisesRegex(Problem, said):
                mould.write(files.read(path), self.folder / "tip", quiet)


class RandomMarkers(unittest.TestCase):
    LAYER = {"columns": 12, "rows": 9, "pitch_mm": 1, "depth_mm": 2, "least_mm": 0.65, "seed": 5, "diameter_mm": 0.3}

    def setUp(self):
        with mesh.Body(fingertip()["shape"], ".") as body:
            corners, free, _, _ = body.surface(0.7)
        self.surface = placement.Surface(corners, free)

    def test_are_apart_on_their_surface_and_the_same_again(self):
        found, _, _ = placement.markers(self.surface, [self.LAYER])
        self.assertEqual(len(found), 12 * 9)
        distance = scipy.spatial.cKDTree(found).query(found, 2)[0][:, 1]
        self.assertGreaterEqual(distance.min(), 0.65)
        np.testing.assert_allclose(np.linalg.norm(found - [0, 0, 10], axis=1), 8, atol=0.05)
        np.testing.assert_array_equal(placement.markers(self.surface, [self.LAYER])[0], found)
        self.assertGreater(abs(placement.markers(self.surface, [self.LAYER | {"seed": 6}])[0] - found).max(), 0.1)

    def test_neighbours_of_the_grid_are_near_each_other(self):
        found, _, _ = placement.markers(self.surface, [self.LAYER])
        for order in (found, placement.markers(self.surface, [self.in_any_order(found)])[0]):
            grid = order.reshape(9, 12, 3)
            for axis in (0, 1):
                self.assertLess(np.linalg.norm(np.diff(grid, axis=axis), axis=2).max(), 2.5)

    def in_any_order(self, found):
        shuffled = np.random.default_rng(1).permutation(found)
        return self.LAYER | {"positions_mm": shuffled.tolist(), "any_order": True}

    def test_a_grid_in_any_order_is_that_grid(self):
        found, _, _ = placement.markers(self.surface, [self.LAYER | {"least_mm": 0}])
        np.testing.assert_array_equal(placement.markers(self.surface, [self.in_any_order(found)])[0], found)

    def test_a_description_has_them(self):
        with tempfile.TemporaryDirectory(prefix="traction-") as folder:
            path = pathlib.Path(folder, "tip.toml")

            def read(lines):
                path.write_text(SHIPPED.read_text().replace("[[layers]]", "[[layers]]\n" + lines))
                return files.read(path)["layers"]

            found, _, _ = placement.markers(self.surface, read("least_mm = 0.65\nseed = 2"))
            self.assertEqual(len(found), 225)
            for lines, said in (("least_mm = -1", "least_mm"), ("seed = 1.5", "seed"), ("any_order = 1", "any_order")):
                with self.subTest(said), self.assertRaisesRegex(Problem, rf"layers\[0\].{said} is"):
                    read(lines)

    def test_more_than_have_room_are_refused(self):
        with self.assertRaisesRegex(Problem, r"layers\[0\]: \d+ of 108 random markers have room at least 1 mm apart"):
            placement.markers(self.surface, [self.LAYER | {"least_mm": 1}])

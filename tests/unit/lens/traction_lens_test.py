"""traction-lens as a person runs it: the commands of docs/sensor.md, word for word, and what it says to wrong ones.

The chessboard's pictures are drawn here, by a camera of the page's own; the gel's by tests/support/independent.py.
"""

import os
import pathlib
import re
import subprocess
import tempfile
import tomllib
import unittest

import numpy as np

import independent
import png
import seed

SOURCE = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ["TRACTION_BUILD"]) / "bin"
COLUMNS, ROWS, FINE = 10, 7, 3  # squares of the board; samples a pixel and direction


def turn(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rays(camera):
    """Directions x / z, y / z that fine samples of the picture see."""
    rows, columns = independent.SHAPE
    u, v = np.meshgrid((np.arange(FINE * columns) + 0.5) / FINE - 0.5, (np.arange(FINE * rows) + 0.5) / FINE - 0.5)
    bent = (np.stack([u, v], axis=-1) - camera.principal_px) / camera.focal_px
    ray = bent.copy()
    for _ in range(20):
        r2 = (ray**2).sum(axis=-1, keepdims=True)
        ray = bent / (1 + camera.k1 * r2 + camera.k2 * r2**2)
    return np.concatenate([ray, np.ones(ray.shape[:2] + (1,))], axis=-1)


def step(x):
    """By how much a place on the board changes from one fine sample to the next: an edge is as wide."""
    return np.maximum(*(np.abs(one) for one in np.gradient(x)))


def inside(x, squares):
    """1 on the board, 0 beside it."""
    return np.clip(x / step(x) + 0.5, 0, 1) * np.clip((squares - x) / step(x) + 0.5, 0, 1)


def stripes(x, squares):
    """1 and -1 from square to square of a row, 0 beside the board: the mean over a sample's width."""
    half = step(x) / 2
    return inside(x, squares) * (np.abs((x - half) % 2 - 1) - np.abs((x + half) % 2 - 1)) / (2 * half)


def board_picture(camera, ray, draw, noise):
    """A board in the picture as a whole, tilted by 15 to 45 degrees."""
    rows, columns = independent.SHAPE
    while True:
        angle = draw.uniform(0, 2 * np.pi)
        pose = turn((np.cos(angle), np.sin(angle), 0), draw.uniform(0.26, 0.78)) @ turn((0, 0, 1), draw.uniform(-0.4, 0.4))
        z = camera.focal_px * COLUMNS / (columns * draw.uniform(0.5, 0.85))
        shift = z * np.array([draw.uniform(-0.15, 0.15), draw.uniform(-0.12, 0.12), 1])
        shift = shift - pose @ [COLUMNS / 2, ROWS / 2, 0]
        rim = np.array([[x, y, 0] for x in (-1, COLUMNS + 1) for y in (-1, ROWS + 1)]) @ pose.T + shift
        seen = camera.principal_px + camera.focal_px * rim[:, :2] / rim[:, 2:]
        if (seen > 5).all() and (seen < np.array([columns, rows]) - 6).all():
            break
    plane = np.linalg.inv(np.stack([pose[:, 0], pose[:, 1], shift], axis=1))
    place = ray @ plane.T
    x, y = place[..., 0] / place[..., 2], place[..., 1] / place[..., 2]
    dark = 0.5 * (inside(x, COLUMNS) * inside(y, ROWS) + stripes(x, COLUMNS) * stripes(y, ROWS))
    levels = 200.0 - 160.0 * dark
    for axis in (0, 1):  # a lens's blur, of two thirds of a pixel
        levels = sum(w * np.roll(levels, s, axis) for s, w in ((-2, 0.2), (-1, 0.2), (0, 0.2), (1, 0.2), (2, 0.2)))
    levels = levels.reshape(rows, FINE, columns, FINE).mean(axis=(1, 3))
    return np.clip(np.rint(levels + noise.normal(0, 1.5, levels.shape)), 0, 255).astype(np.uint8)


def run(*arguments, cwd=None):
    return subprocess.run([BIN / "traction-lens", *arguments], capture_output=True, text=True, cwd=cwd, timeout=120)


def random_camera(draw):
    """With every marker in the picture."""
    while True:
        camera = independent.Camera(position_mm=(draw.uniform(-3, 3), draw.uniform(-3, 3), 157 + draw.uniform(-2, 2)),
                                    rotation_rad=tuple(draw.uniform(-0.01, 0.01) for _ in range(3)),
                                    focal_px=draw.uniform(920, 960), principal_px=(319.5 + draw.uniform(-5, 5), 240.0),
                                    k1=draw.uniform(-0.15, 0.05), k2=draw.uniform(-0.05, 0.05))
        pixels = camera.project(independent.MARKERS)
        if (pixels > 8).all() and (pixels < np.array(independent.SHAPE[::-1]) - 8).all():
            return camera


class Page(unittest.TestCase):
    def test_its_commands_lead_to_the_truth(self):
        draw, noise = seed.chance(self.id()), np.random.default_rng(seed.SEED)
        camera = random_camera(draw)
        page = (SOURCE / "docs/sensor.md").read_text()
        blocks = re.findall(r"^```\n(.*?)^```", page, re.M | re.S)
        commands = [line for block in blocks for line in block.splitlines() if line.startswith("traction-lens ")]
        self.assertEqual([line.split()[1] for line in commands], ["calibrate", "sheet", "pose", "mark"])
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "board").mkdir()
            ray = rays(camera)
            for i in range(15):
                png.write(folder / f"board/{i:02}.png", board_picture(camera, ray, draw, noise))
            levels = independent.picture(camera, camera.project(independent.MARKERS))
            levels += noise.normal(0, 2, levels.shape)
            png.write(folder / "rest.png", np.clip(np.rint(levels), 0, 255).astype(np.uint8))
            for command in commands:
                done = subprocess.run(command, shell=True, capture_output=True, text=True, cwd=folder, timeout=300,
                                      env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
                print(command, done.stdout, done.stderr, sep="\n")
                self.assertEqual(done.returncode, 0, done.stderr)
            lens = tomllib.loads((folder / "lens.toml").read_text())
            gel = tomllib.loads((folder / "gel.toml").read_text())
            self.assertTrue((folder / "sheets/layer2.svg").exists())
            self.assertTrue((folder / "marked.png").exists())
        found, known = lens["camera"], lens["uncertainty"]
        self.assertAlmostEqual(found["focal_px"] / camera.focal_px, 1, delta=5 * known["focal_relative"])
        self.assertLess(known["focal_relative"], 1e-3)
        for i in range(2):
            self.assertAlmostEqual(found["principal_px"][i], camera.principal_px[i], delta=5 * known["principal_px"])
        self.assertAlmostEqual(found["k1"], camera.k1, delta=5 * known["k1"])
        self.assertAlmostEqual(found["k2"], camera.k2, delta=5 * known["k2"])
        found, known = gel["camera"], gel["uncertainty"]
        for i in range(3):
            self.assertAlmostEqual(found["position_mm"][i], camera.position_mm[i], delta=5 * known["position_mm"][i])
            self.assertAlmostEqual(found["rotation_rad"][i], camera.rotation_rad[i], delta=5 * known["rotation_rad"][i])


class CommandLine(unittest.TestCase):
    def check(self, arguments, code, words):
        done = run(*arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1)
        self.assertTrue(lines[0].startswith("traction-lens: "), lines[0])
        self.assertIn(words, lines[0])

    def test_what_is_wrong_is_said(self):
        self.check([], 64, "a command is needed")
        self.check(["nonsense"], 64, "nonsense")
        self.check(["calibrate", "a.png", "--square-mm", "10", "--output", "o"], 64, "--squares")
        for squares in ("9", "9x", "x6", "9x6x", "3x6", "-9x6", "999999x6"):
            self.check(["calibrate", "a.png", "--squares=" + squares, "--square-mm", "10", "--output", "o"], 64,
                       "--squares is to be two numbers")
        self.check(["calibrate", "no.png", "--squares", "9x6", "--square-mm", "10", "--output", "o"], 66, "no.png")
        self.check(["calibrate", "no.png", "--squares", "9x6", "--square-mm", "10.2x10", "--output", "o"], 66, "no.png")
        self.check(["calibrate", "no.png", "--squares", "6x6", "--square-mm", "10.2x10", "--output", "o"], 64, "oblong")
        for side in ("x", "10x", "10y10", "0", "-1", "nan", "10x10x10", "10x0.01", "1e9"):
            self.check(["calibrate", "a.png", "--squares=9x6", "--square-mm=" + side, "--output", "o"], 64,
                       "--square-mm is to be one or two lengths")
        self.check(["pose", "no.png", "--gel", "no.toml", "--output", "o"], 66, "no.toml")
        self.check(["sheet", "--output-dir", "/proc/none"], 73, "/proc/none/layer1.svg")

    def test_help_and_version(self):
        for arguments in (["--help"], ["calibrate", "--help"], ["pose", "--help"], ["mark", "--help"],
                          ["sheet", "--help"], ["--version"]):
            done = run(*arguments)
            self.assertEqual(done.returncode, 0)
            self.assertEqual(done.stderr, "")
            self.assertIn("traction-lens" if arguments != ["--version"] else "0.", done.stdout)


if __name__ == "__main__":
    unittest.main()

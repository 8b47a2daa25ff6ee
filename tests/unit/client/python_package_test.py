"""The Python client as a package: from the tree with pip, its version, its types."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[3]
CLIENT = SOURCE / "client" / "python"
sys.path.insert(0, str(CLIENT))
import traction  # noqa: E402


class Package(unittest.TestCase):
    def test_the_documented_lines_install_it_from_the_tree(self):
        lines = re.search(r"^python3 -m venv .*\n.*/pip install .* client/python$", (SOURCE / "docs/clients.md").read_text(),
                          re.MULTILINE)[0]
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))
        for part in ("client/python", "proto/traction"):  # pip writes beside what it installs
            shutil.copytree(SOURCE / part, folder / "tree" / part, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
        environment = {**os.environ, "HOME": str(folder), "PIP_NO_INDEX": "1",
                       "PATH": f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
        environment.pop("PYTHONPATH", None)
        done = subprocess.run(["sh", "-ec", lines], env=environment, cwd=folder / "tree", capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        shutil.rmtree(folder / "tree")
        told = subprocess.run([folder / "traction/bin/python", "-c", "import traction.ros2 as it; print(it.__file__)"],
                              env=environment, cwd=folder, capture_output=True, text=True)
        self.assertEqual(told.returncode, 0, told.stderr)
        package = pathlib.Path(told.stdout.strip()).parents[1]
        self.assertTrue(package.is_relative_to(folder / "traction"))
        for name in ("py.typed", "v1.descriptors"):
            self.assertTrue((package / name).is_file(), name)

    def test_has_the_version_of_the_project(self):
        version = re.search(r"project\(tractiond VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertIn(f'\nversion = "{version}"\n', (CLIENT / "pyproject.toml").read_text())
        self.assertEqual(traction.__version__, version)

    def test_types_are_sound(self):
        mypy = shutil.which("mypy", path="/usr/bin:/bin")
        if mypy is None:
            self.skipTest("mypy is not here")
        with tempfile.TemporaryDirectory(prefix="traction-") as cache:
            done = subprocess.run([mypy, "--cache-dir", cache], cwd=CLIENT, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)

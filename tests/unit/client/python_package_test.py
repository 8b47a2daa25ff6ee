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
    def test_pip_installs_it_from_the_tree(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))
        for part in ("client/python", "proto/traction"):  # pip writes beside what it installs
            shutil.copytree(SOURCE / part, folder / "tree" / part, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", "--no-deps"]
        done = subprocess.run([*pip, "--target", folder / "there", folder / "tree/client/python"], capture_output=True,
                              text=True)
        if "No module named pip" in done.stderr:
            self.skipTest("python3-pip is not here")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        shutil.rmtree(folder / "tree")
        told = subprocess.run([sys.executable, "-c", "import traction.ros2; print(traction.__file__, traction.__version__)"],
                              env={**os.environ, "PYTHONPATH": str(folder / "there")}, cwd=folder, capture_output=True, text=True)
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertEqual(told.stdout.split(), [str(folder / "there/traction/__init__.py"), traction.__version__])
        self.assertTrue((folder / "there/traction/py.typed").exists())

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


if __name__ == "__main__":
    unittest.main()

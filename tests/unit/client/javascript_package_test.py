"""The JavaScript client as a package: what npm packs of it, and that the documented line installs it."""

import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import suite

SOURCE = pathlib.Path(__file__).resolve().parents[3]
CLIENT = SOURCE / "client" / "javascript"


class Package(unittest.TestCase):
    def npm(self, *words, folder):
        npm = shutil.which("npm")
        if npm is None:
            self.skipTest("npm is not here")
        done = subprocess.run([npm, *map(str, words)], cwd=folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def folder(self):
        return pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def test_npm_packs_all_that_its_files_import(self):
        packed = json.loads(self.npm("pack", "--offline", "--dry-run", "--json", CLIENT, folder=self.folder()))
        if isinstance(packed, dict):  # by name, in later versions
            packed = [*packed.values()]
        files = {one["path"] for one in packed[0]["files"]}
        self.assertIn("v1.descriptors", files)
        for path in CLIENT.glob("*.js"):
            for wanted in re.findall(r'from "\./([^"]+)"', path.read_text()):
                self.assertIn(wanted, files, path)
        self.assertEqual((CLIENT / "v1.descriptors").read_bytes(), (SOURCE / "proto/traction/v1.descriptors").read_bytes(),
                         "ninja commit_descriptors")

    @suite.npm
    def test_npm_installs_it_by_the_documented_line(self):
        line = re.search(r"npm (install .*)PATH/client/javascript", (SOURCE / "docs/clients.md").read_text())[1]
        folder = self.folder()
        (folder / "package.json").write_text("{}")
        self.npm(*line.split(), "--no-audit", "--no-fund", CLIENT, folder=folder)
        script = "import {decode, fields} from 'traction'; fields().subscriber.close(); " \
                 "console.log(decode('Field', new Uint8Array([9, 0, 0, 0, 0, 0, 0, 240, 63])).timestamp)"
        done = subprocess.run(["node", "--input-type=module", "-e", script], cwd=folder, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (0, "1\n"), done.stderr)

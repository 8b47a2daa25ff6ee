"""What `cmake --install` puts where; tools/uninstall."""

import os
import pathlib
import re
import shutil
import subprocess
import unittest

from scripts import SOURCE, TOOLS, Scratch

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])


class Install(unittest.TestCase):
    def setUp(self):
        self.place = Scratch(self)
        self.prefix = self.place.scratch / "prefix"
        code, text = self.place.run("cmake", "--install", BUILD, "--prefix", self.prefix)
        self.assertEqual(code, 0, text)
        self.list = self.place.folder / "build" / "install_manifest.txt"
        self.list.parent.mkdir()
        shutil.copy(BUILD / self.list.name, self.list)

    def files(self):
        return {str(path.relative_to(self.prefix)) for path in self.prefix.rglob("*") if not path.is_dir()}

    def test_everything_is_where_it_is_looked_for(self):
        files = self.files()
        for wanted in ("bin/tractiond", "bin/tractionctl", "bin/traction-twin", "bin/traction-gateway", "bin/traction-touch",
                       "bin/traction-input", "share/tractiond/input/mouse.toml", "lib/systemd/user/traction-input@.service",
                       "lib/udev/rules.d/70-traction-input.rules",
                       "lib/systemd/system/tractiond@.service", "lib/systemd/system/traction-gateway@.service",
                       "lib/systemd/system/traction-touch@.service",
                       "lib/systemd/system/traction-metrics.socket", "lib/systemd/system/traction-metrics@.service",
                       "share/tractiond/prometheus/alerts.yml", "share/tractiond/grafana/tractiond.json", "share/man/man8/tractiond.8",
                       "share/man/man1/tractionctl.1", "share/man/man5/tractiond.toml.5",
                       "share/bash-completion/completions/tractionctl",
                       "share/zsh/site-functions/_tractionctl",
                       "share/fish/vendor_completions.d/tractionctl.fish",
                       "lib/sysusers.d/tractiond.conf", "lib/sysctl.d/60-tractiond.conf", "lib/tmpfiles.d/tractiond.conf",
                       "lib/udev/rules.d/60-tractiond.rules", "share/tractiond/tractiond.toml",
                       "share/doc/tractiond/examples/realtime.conf"):
            self.assertIn(wanted, files)

    def test_every_file_belongs_to_one_debian_package(self):
        lists = "".join(path.read_text() for path in (SOURCE / "debian").glob("*.install"))
        patterns = [line.split()[0] for line in lists.splitlines()]
        for file in self.files():
            path = f"usr/{file}".replace("site-functions", "vendor-completions")  # as debian/rules moves them
            path = pathlib.PurePath(re.sub(r"^usr/lib/(libtraction|cmake)", r"usr/lib/triplet/\1", path))
            holders = [one for one in patterns if any(start.match(one) for start in (path, *path.parents))]
            self.assertEqual(len(holders), 1, f"{path}: {holders}")

    def test_the_services_run_in_a_tight_sandbox(self):
        for unit in ("tractiond@.service", "traction-metrics@.service"):
            done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=15", "--no-pager",
                                   self.prefix / "lib/systemd/system" / unit], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_uninstalling_leaves_nothing_of_ours_and_all_of_others(self):
        other = self.prefix / "share" / "other" / "file"
        other.parent.mkdir()
        other.touch()
        code, text = self.place.run(TOOLS / "uninstall", self.list.parent)
        self.assertEqual(code, 0, text)
        self.assertEqual(self.files(), {"share/other/file"})
        self.assertEqual([path for path in self.prefix.rglob("*traction*")], [])
        self.assertEqual(self.place.run(TOOLS / "uninstall", self.list.parent)[0], 66)  # there is nothing any more

"""What `cmake --install` puts where; tools/uninstall; and the rules for USB3 Vision cameras."""

import fnmatch
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from stubs import SOURCE, TOOLS, Stubs

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
RULES = SOURCE / "systemd" / "udev.rules"
UDEVADM_VERIFIES = bool(shutil.which("udevadm")) and b"verify" in subprocess.check_output(["udevadm", "--help"])


class Install(unittest.TestCase):
    def setUp(self):
        self.stubs = Stubs(self)
        self.prefix = self.stubs.scratch / "prefix"
        code, text = self.stubs.run("cmake", "--install", BUILD, "--prefix", self.prefix)
        self.assertEqual(code, 0, text)
        self.list = self.stubs.folder / "build" / "install_manifest.txt"
        self.list.parent.mkdir()
        shutil.copy(BUILD / self.list.name, self.list)

    def files(self):
        return {str(path.relative_to(self.prefix)) for path in self.prefix.rglob("*") if not path.is_dir()}

    def test_everything_is_where_it_is_looked_for(self):
        files = self.files()
        for wanted in ("bin/tractiond", "bin/tractionctl", "bin/traction-twin", "bin/traction-gateway",
                       "lib/systemd/system/tractiond@.service", "lib/systemd/system/traction-gateway@.service",
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
        for unit, tenths in (("tractiond@.service", 15), ("traction-metrics@.service", 15)):
            self.check_sandbox(unit, tenths)

    def check_sandbox(self, unit, tenths):
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", f"--threshold={tenths}", "--no-pager",
                               self.prefix / "lib/systemd/system" / unit], capture_output=True, text=True)
        print(f"\n  {done.stdout.strip().splitlines()[-1]}")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_uninstalling_leaves_nothing_of_ours_and_all_of_others(self):
        other = self.prefix / "share" / "other" / "file"
        other.parent.mkdir()
        other.touch()
        code, text = self.stubs.run(TOOLS / "uninstall", self.list.parent)
        self.assertEqual(code, 0, text)
        self.assertEqual(self.files(), {"share/other/file"})
        self.assertEqual([path for path in self.prefix.rglob("*traction*")], [])
        self.assertEqual(self.stubs.run(TOOLS / "uninstall", self.list.parent)[0], 66)  # there is nothing any more


class Rules(unittest.TestCase):
    """Read as udev reads them: keys, operators, values; patterns as of the shell, with | between alternatives."""

    MATCH = {"ACTION", "SUBSYSTEM", "ENV{DEVTYPE}", "ENV{ID_USB_INTERFACES}"}
    ASSIGN = {"GROUP", "MODE", "TAG"}

    def rules(self):
        for line in RULES.read_text().splitlines():
            if line and not line.startswith("#"):
                pairs = re.findall(r'([A-Z]+(?:\{\w+\})?)(==|!=|\+=|=)"([^"]*)"(?:, |$)', line)
                self.assertEqual(", ".join(f'{key}{op}"{value}"' for key, op, value in pairs), line)
                yield pairs

    def apply(self, interfaces, action="add", subsystem="usb", kind="usb_device"):
        event = {"ACTION": action, "SUBSYSTEM": subsystem, "ENV{DEVTYPE}": kind, "ENV{ID_USB_INTERFACES}": interfaces}
        done = {}
        for pairs in self.rules():
            matches = True
            for key, op, value in pairs:
                if op in ("==", "!="):
                    self.assertIn(key, self.MATCH)
                    one = any(fnmatch.fnmatchcase(event[key], pattern) for pattern in value.split("|"))
                    matches = matches and one == (op == "==")
                else:
                    self.assertIn(key, self.ASSIGN)
            if matches:
                done.update({key: value for key, op, value in pairs if op in ("=", "+=")})
        return done

    def test_cameras_of_the_standard_belong_to_the_group(self):
        for interfaces in (":ef0500:ef0501:ef0502:", ":ef0500:", ":0e0100:ef0500:ef0502:", ":ef0502:ff0000:"):
            done = self.apply(interfaces)
            self.assertEqual((done.get("GROUP"), done.get("MODE")), ("tractiond", "0660"), interfaces)

    def test_nothing_else_does(self):
        for interfaces in (":030101:", ":ef0201:0e0100:", ":080650:", ":ff0500:", ":0eef05:", ""):
            self.assertEqual(self.apply(interfaces), {}, interfaces)
        self.assertEqual(self.apply(":ef0500:", action="remove"), {})
        self.assertEqual(self.apply(":ef0500:", subsystem="block"), {})
        self.assertEqual(self.apply(":ef0500:", kind="usb_interface"), {})

    def test_the_group_is_made(self):
        users = (SOURCE / "systemd" / "sysusers.conf").read_text()
        self.assertRegex(users, r"(?m)^[ug] tractiond ")  # a user has a group of its name

    if UDEVADM_VERIFIES:  # since systemd 254, which Debian 12 has not
        def test_udev_understands_them(self):
            done = subprocess.run(["udevadm", "verify", "--resolve-names=never", RULES], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()

"""What debian/ says is what tools/dependencies installs, and the project's version."""

import re
import subprocess
import unittest

from scripts import SOURCE, TOOLS


class Packages(unittest.TestCase):
    def test_debian_builds_with_the_same(self):
        text = re.search(r"Build-Depends:\n((?: .*\n)*)", (SOURCE / "debian" / "control").read_text())[1]
        needed = set(subprocess.check_output([TOOLS / "dependencies", "--list", "build", "lens", "viewer"], text=True).split())
        packages = {re.split("[ :]", line.strip(" ,"))[0] for line in text.splitlines()}
        self.assertEqual({one for one in packages if not one.startswith(("debhelper", "dh-"))},
                         needed - {"g++", "iproute2", "libopencv-video-dev"})

    def test_debian_has_the_version_of_the_project(self):
        version = re.search(r"project\(tractiond VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertEqual((SOURCE / "debian" / "changelog").read_text().split(")")[0], f"tractiond ({version}")


if __name__ == "__main__":
    unittest.main()

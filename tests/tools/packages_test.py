"""tools/dependencies and tools/progress: what is listed, what is said, and how they end; and what debian/ says, too."""

import re
import unittest

import suite
from stubs import SOURCE, TOOLS, Stubs


class Dependencies(unittest.TestCase):
    def setUp(self):
        self.stubs = Stubs(self)

    def list(self, *groups):
        code, text = self.stubs.run(TOOLS / "dependencies", "--list", *groups)
        self.assertEqual(code, 0, text)
        return set(text.split())

    def test_groups_add_up_to_all(self):
        groups = [self.list(group) for group in ("build", "test", "lens", "viewer", "page", "coverage")]
        self.assertEqual(set().union(*groups), self.list())
        self.assertEqual(self.list(), self.list("all"))
        self.assertEqual(self.list("build", "test"), groups[0] | groups[1])
        self.assertFalse(groups[0] & groups[1])

    def test_the_demo_needs_no_package_of_the_tests_or_of_opencv(self):
        for package in self.list("build"):
            self.assertNotRegex(package, "gtest|gmock|benchmark|numpy|opencv")

    def test_every_package_says_what_it_is_for(self):
        table = re.search(r"<<'END'\n(.*?)\nEND\n", (TOOLS / "dependencies").read_text(), re.S)[1]
        for line in table.splitlines():
            self.assertRegex(line, r"^(build|test|lens|viewer|page|coverage) +[a-z0-9.+-]+ +# \S")

    def test_an_unknown_group_is_refused(self):
        code, text = self.stubs.run(TOOLS / "dependencies", "everything")
        self.assertEqual(code, 64)
        self.assertIn("everything", text)

    def test_installs_what_is_missing_of_the_group_alone(self):
        self.stubs.add("dpkg-query", "printf 'ii cmake\\nii g++\\n'")
        self.stubs.add("id", "echo 0")
        self.stubs.add("apt-get", "exit 0")
        code, text = self.stubs.run(TOOLS / "dependencies", "build")
        self.assertEqual(code, 0, text)
        install = [line for line in self.stubs.called().splitlines() if " install " in line]
        self.assertEqual(len(install), 1)
        words = set(install[0].split())
        self.assertIn("--no-install-recommends", words)
        self.assertEqual(words & self.list(), self.list("build") - {"cmake", "g++"})

    def test_a_single_tool_gets_its_packages_without_a_question(self):
        self.stubs.add("dpkg-query", "printf 'ii lintian\\n'")
        self.stubs.add("id", "echo 0")
        self.stubs.env.pop("DEBIAN_FRONTEND", None)
        self.stubs.add("apt-get", '[ "$DEBIAN_FRONTEND" = noninteractive ]')  # else debconf waits for an answer
        code, text = self.stubs.run(TOOLS / "dependencies", "--packages", "lintian", "debhelper")
        self.assertEqual(code, 0, text)
        self.assertRegex(self.stubs.called(), r"apt-get .* update\napt-get .*=--force-confold install .* debhelper\n\Z")

    def test_nothing_is_done_when_nothing_is_missing(self):
        self.stubs.add("dpkg-query", "sed 's/^/ii /' <<END\n" + "\n".join(self.list()) + "\nEND")
        self.stubs.add("apt-get")
        self.stubs.add("sudo")
        self.assertEqual(self.stubs.run(TOOLS / "dependencies"), (0, ""))
        self.assertNotIn("apt-get", self.stubs.called())

    def test_without_root_and_sudo_says_what_is_missing(self):
        self.stubs.add("dpkg-query", "exit 0")
        self.stubs.add("id", "echo 1000")
        for tool in ("bash", "env", "dirname", "sed", "sort", "comm"):
            self.stubs.add(tool, f'exec /usr/bin/{tool} "$@"')
        self.stubs.env["PATH"] = str(self.stubs.folder)  # no sudo
        code, text = self.stubs.run(TOOLS / "dependencies", "build")
        self.assertEqual(code, 77, text)
        self.assertIn("libaravis-dev", text)

    def test_debian_builds_with_the_same(self):
        text = re.search(r"Build-Depends:\n((?: .*\n)*)", (SOURCE / "debian" / "control").read_text())[1]
        packages = {re.split("[ :]", line.strip(" ,"))[0] for line in text.splitlines()}
        self.assertEqual({one for one in packages if not one.startswith(("debhelper", "dh-"))},
                         self.list("build", "lens", "viewer") - {"g++", "iproute2", "libopencv-video-dev"})

    def test_debian_has_the_version_of_the_project(self):
        version = re.search(r"project\(tractiond VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertEqual((SOURCE / "debian" / "changelog").read_text().split(")")[0], f"tractiond ({version}")


class Progress(unittest.TestCase):
    def setUp(self):
        self.stubs = Stubs(self)

    def run_script(self, script, every_s=0):
        self.stubs.env["TRACTION_PROGRESS_S"] = str(every_s)
        return self.stubs.run(TOOLS / "progress", "work", "sh", "-c", script)

    def test_exit_code_is_the_commands_and_its_words_are_shown(self):
        code, text = self.run_script("echo what went wrong; exit 7")
        self.assertEqual(code, 7)
        self.assertIn("what went wrong", text)
        self.assertIn("exit code 7", text)

    def test_words_of_a_command_that_succeeds_are_not_shown_at_its_end(self):
        code, text = self.run_script("echo chatter", every_s=60)
        self.assertEqual(code, 0)
        self.assertNotIn("chatter", text)

    def test_ninja_is_counted_and_estimated(self):
        _, text = self.run_script("for i in 1 2 3 4 5; do echo \"[$i/10] CXX a/b$i.o\"; done")
        self.assertRegex(text, r"5 of 10 steps, about \d+ s more \(b5\.o\)")

    def test_apt_says_how_much_there_is_and_how_far_it_is(self):
        _, text = self.run_script(
            "echo '0 upgraded, 12 newly installed, 0 to remove and 0 not upgraded.';"
            "echo 'Need to get 34.5 MB of archives.';"
            "echo 'dlstatus:3:41.7:Retrieving file 3 of 12';"
            "echo 'pmstatus:g++-12:66.6:Unpacking g++-12'; printf 'Unpacking g++-12 ...\\r\\n'")
        for words in ("12 to install", "34.5 MB to fetch", "41 % fetched (Retrieving file 3 of 12)",
                      "66 % unpacked and set up (g++-12)"):
            self.assertIn(words, text)
        self.assertNotIn("Unpacking g++", text)  # nothing hides how far it is

    @suite.realtime
    def test_speaks_at_once_and_every_second_whatever_the_command_does(self):
        _, text = self.run_script("printf half; sleep 4.2; echo ' a line'", every_s=1)
        self.assertTrue(text.startswith("work: started"), text)
        seconds = [int(number) for number in re.findall(r"(\d+) s so far", text)]
        self.assertGreaterEqual(2 * len(seconds), int(re.search(r"done in (\d+) s", text)[1]), text)


if __name__ == "__main__":
    unittest.main()

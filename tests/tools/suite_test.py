"""The tests themselves: one source of chance, marks that are understood, command lines of tools/test."""

import contextlib
import fnmatch
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import unittest

import mutations
import past_faults
import random_mutations
from deadline import HUNG_S
from stubs import SOURCE, TOOLS, Stubs

TESTS = SOURCE / "tests"
SUPPORT = TESTS / "support"
# Each draws what no seed repeats.
UNSEEDED = {
    ".cpp": r"random_device|urandom|getentropy|getrandom|\bs?rand\(|TRACTION_SEED\b.*getenv|getenv.*TRACTION_SEED",
    ".py": r"urandom|\bsecrets\b|SystemRandom|default_rng\(\)|\brandom\.Random\(\)|TRACTION_SEED.*environ|environ.*TRACTION_SEED"
           r"|\bnp\.random\.(?!default_rng|Generator)\w+"
           r"|\brandom\.(random|choices?|randrange|randint|uniform|randbytes|getrandbits|seed|sample|shuffle|expovariate|gauss)\(",
}
UNSEEDED[".h"] = UNSEEDED[".cpp"]
SOURCES_OF_CHANCE = {SUPPORT / "seed.h", SUPPORT / "seed.py", pathlib.Path(__file__).resolve()}


def run_python(*words, **environment):
    """Runs Python with tests/support on its path; its exit code and what it printed."""
    done = subprocess.run([sys.executable, "-B", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**os.environ, "PYTHONPATH": str(SUPPORT), **environment})
    return done.returncode, done.stdout


class Chance(unittest.TestCase):
    def test_comes_from_the_seed_alone(self):
        files = [file for file in TESTS.rglob("*") if file.suffix in UNSEEDED and "node_modules" not in file.parts]
        self.assertGreater(len(files), 200)
        found = [f"{file.relative_to(SOURCE)}:{number}: {line.strip()}" for file in files
                 if file.resolve() not in SOURCES_OF_CHANCE
                 for number, line in enumerate(file.read_text().splitlines(), 1) if re.search(UNSEEDED[file.suffix], line)]
        self.assertEqual(found, [], "draw from tests/support/seed.h or seed.py instead")

    def test_a_clock_is_no_seed(self):
        seeded = re.compile(r"(mt19937(_64)?|minstd_rand|Random|default_rng)\b[^;\n]*(now\(\)|time_ns|time\(\)|monotonic)")
        for file in TESTS.rglob("*"):
            if file.suffix in UNSEEDED and file.resolve() not in SOURCES_OF_CHANCE:
                self.assertNotRegex(file.read_text(), seeded, file)

    def test_is_the_same_in_both_languages(self):
        fixed = re.search(r"kFixedSeed = (\d+)", (SUPPORT / "seed.h").read_text())[1]
        self.assertEqual(run_python("-c", "import seed; print(seed.FIXED)"), (0, fixed + "\n"))

    def test_is_fixed_without_a_number_and_repeated_with_one(self):
        draw = "import seed; print(seed.chance('a').random(), seed.chance('b').random())"
        environment = {key: value for key, value in os.environ.items() if key != "TRACTION_SEED"}
        fixed = [subprocess.check_output([sys.executable, "-Bc", draw], text=True,
                                         env={**environment, "PYTHONPATH": str(SUPPORT)}) for _ in range(2)]
        self.assertEqual(fixed[0], fixed[1])
        other = [run_python("-c", draw, TRACTION_SEED="7") for _ in range(2)]
        self.assertEqual(other[0], other[1])
        self.assertIn("TRACTION_SEED=7", other[0][1])
        self.assertNotEqual(fixed[0].splitlines()[-1], other[0][1].splitlines()[-1])

    def test_a_seed_that_is_no_number_is_refused(self):
        for wrong in ("", "x", "-1", "1.5", "4294967296", "0x7", " 7", "٣"):
            said = f"TRACTION_SEED is '{wrong}', must be a whole number below 2^32\n"
            self.assertEqual(run_python("-c", "import seed", TRACTION_SEED=wrong), (64, said))
            for words in ([], ["all"]):
                done = subprocess.run([TOOLS / "test", *words], capture_output=True, text=True,
                                      env={**os.environ, "TRACTION_SEED": wrong})
                self.assertEqual((done.returncode, done.stderr), (64, "test: " + said))


class Waits(unittest.TestCase):
    """In the gate no test sleeps and then asserts, and no deadline is shorter than a minute."""

    SLEEP = re.compile(r"sleep_for\(|\bsleep\(")
    ASSERTION = re.compile(r"EXPECT_|ASSERT_|self\.assert")
    DEADLINE = re.compile(r"""rcvtimeo,\s*(?P<ms>[\d']+)|(?:communicate|run|join)\([^()]*timeout=(?P<s>\d+)"""
                          r"""|\.wait_for\(r?f?".*",\s*(?P<line_s>\d+)\)""")
    FOLDERS = {"client": "unit/client", "clients": "conformance", "lens": "unit/lens", "system": "system", "tools": "tools"}

    def test_hung_is_the_same_in_both_languages(self):
        seconds = re.search(r"kHung\{(\d+)\}", (SUPPORT / "deadline.h").read_text())[1]
        self.assertEqual(run_python("-c", "import deadline; print(f'{deadline.HUNG_S:.0f}')"), (0, seconds + "\n"))

    def gate_files(self):
        """Yields C++ test files of the rooms and those Python files that are in the gate."""
        yield from (file for file in sorted((TESTS / "unit").rglob("*")) if file.suffix in (".cpp", ".h"))
        for line in (TESTS / "gate.txt").read_text().splitlines():
            folder, _, name = line.split()[1].partition(".")
            file = TESTS / self.FOLDERS.get(folder, "") / f"{name}_test.py"
            if file.exists() and file != pathlib.Path(__file__).resolve():
                yield file

    @staticmethod
    def real_time_filters(folder):
        """Returns GoogleTest's filters of the folder's real-time tests, and the files that have no other."""
        filters, files = [], set()
        listing = folder / "CMakeLists.txt"
        for call in re.findall(r"traction_test\(([^()]*)\)", listing.read_text() if listing.exists() else ""):
            for key, value in re.findall(r'(REALTIME|STATISTICS|MINUTES) +"([^"]*)"', call):
                filters += value.split(":")
                if value == "*":
                    filters.pop()
                    files.update(re.findall(r"\w+_test\.cpp", call))
        return filters, files

    def faults(self, file):
        lines = file.read_text().splitlines()
        filters, apart = self.real_time_filters(file.parent)
        marked = class_marked = file.name in apart
        for number, line in enumerate(lines):
            if begin := re.match(r"TEST(?:_[FP])?\((\w+), (\w+)\)", line):
                marked = file.name in apart or any(fnmatch.fnmatchcase(f"{begin[1]}.{begin[2]}", each) for each in filters)
            elif re.match(r"class ", line):
                marked = class_marked = lines[number - 1].startswith("@suite.")
            elif re.match(r"    def test_", line):
                marked = class_marked or lines[number - 1].startswith("    @suite.")
            if marked:
                continue
            after = next((each for each in lines[number + 1:] if each.strip(" })];")), "")
            if self.SLEEP.search(line) and self.ASSERTION.search(after):
                yield f"{file}:{number + 1}: sleeps, then asserts: {after.strip()}"
            if found := self.DEADLINE.search(line):
                ms, s = found["ms"], found["s"] or found["line_s"]
                if (ms and int(ms.replace("'", "")) < 60_000) or (s and int(s) < 60):
                    yield f"{file}:{number + 1}: a deadline below a minute: {line.strip()}"

    def test_a_condition_is_waited_for(self):
        files = list(self.gate_files())
        self.assertGreater(len(files), 120)
        self.assertEqual([fault for file in files for fault in self.faults(file)], [])

    def test_the_check_finds_what_it_looks_for(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "a_test.cpp")
            file.write_text("TEST(A, B) {\n  std::this_thread::sleep_for(1ms);\n  EXPECT_TRUE(done);\n"
                            "  socket.set(zmq::sockopt::rcvtimeo, 10'000);\n}\n")
            self.assertEqual(len(list(self.faults(file))), 2)
            (file.parent / "CMakeLists.txt").write_text('traction_test(a REALTIME "A.*" SOURCES a_test.cpp)\n')
            self.assertEqual(list(self.faults(file)), [])
            script = pathlib.Path(folder, "b_test.py")
            script.write_text('class B:\n    def test_b(self):\n        time.sleep(1)\n        self.assertTrue(x)\n'
                              '        daemon.wait_for("ready", 30)\n        child.communicate(timeout=10)\n')
            self.assertEqual(len(list(self.faults(script))), 3)


class Marks(unittest.TestCase):
    FILE = textwrap.dedent("""\
        import unittest
        import suite
        class Mixed(unittest.TestCase):
            def test_plain(self): pass
            @{suite}.realtime
            def test_timed(self): pass
        @{suite}.statistics
        class Drawn(unittest.TestCase):
            def test_shares(self): pass
        """).replace("{suite}", "suite")  # CMake looks for marks in this file, too

    def run_part(self, part, *names):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "example_test.py").write_text(self.FILE)
            done = subprocess.run([sys.executable, "-B", SUPPORT / "suite.py", part, *names], cwd=folder,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  env={**os.environ, "PYTHONPATH": str(SUPPORT)})
        return done.returncode, sorted(re.findall(r"^(test_\w+)", done.stdout, re.M))

    def test_each_part_runs_what_bears_its_mark(self):
        for part, tests in (("unmarked", ["test_plain"]), ("realtime", ["test_timed"]), ("statistics", ["test_shares"]),
                            ("every", ["test_plain", "test_shares", "test_timed"])):
            self.assertEqual(self.run_part(part, "example_test"), (0, tests))

    def test_nothing_to_run_is_a_failure(self):
        self.assertEqual(self.run_part("minutes", "example_test"), (1, []))
        self.assertEqual(self.run_part("every", "no_such_test")[0], 1)
        self.assertEqual(self.run_part("fast", "example_test")[0], 64)


class CommandLine(unittest.TestCase):
    def test_what_is_not_understood_is_said(self):
        for words, answer in ((["nonsense"], "test: 'nonsense' is not understood; see tools/test --help\n"),
                              (["--list", "more"], "test: 'more' is not understood; see tools/test --help\n"),
                              (["all", "debug"], "test: no preset is called 'debug': release, asan, tsan\n")):
            done = subprocess.run([TOOLS / "test", *words], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (64, answer))

    def test_help(self):
        done = subprocess.run([TOOLS / "test", "--help"], capture_output=True, text=True, check=True)
        for word in ("all", "--list", "--accept", "TRACTION_SEED"):
            self.assertIn(word, done.stdout)


class Machines(unittest.TestCase):
    """tools/test in a tree of its own, with programs that stand in for the compiler and for ctest."""

    GATE = "release ring 1\nasan ring 1\ntsan ring 1\n"
    CTEST = """
        for word in "$@"; do case $last in --output-junit) junit=$word ;; esac; last=$word; done
        mkdir -p "$(dirname "$junit")"
        echo '<testsuite><testcase name="ring" time="1" status="run"/></testsuite>' >"$junit"
        """

    def setUp(self):
        self.stubs = Stubs(self)
        self.tree = self.stubs.folder / "tree"
        for path in ("tools/test", "tools/dependencies", "tools/progress", "tests/support/tally.py", "tests/support/seed.py"):
            (self.tree / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / path, self.tree / path)
        (self.tree / "tests" / "gate.txt").write_text(self.GATE)
        packages = subprocess.check_output([TOOLS / "dependencies", "--list"], text=True).split()
        self.stubs.add("dpkg-query", "printf 'ii %s,\\n' " + " ".join(packages))
        self.stubs.add("build", "exit 0", self.tree / "tools")
        self.stubs.add("unshare", "exit 0")
        self.stubs.add("ctest", self.CTEST)

    def run_test(self, *words):
        return self.stubs.run(self.tree / "tools" / "test", *words)

    def start_test(self):
        """Starts tools/test in a session of its own; its output goes into a pipe."""
        process = subprocess.Popen([self.tree / "tools" / "test"], env=self.stubs.env, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True, start_new_session=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(self.end_session, process)
        return process

    @staticmethod
    def end_session(process):
        with contextlib.suppress(ProcessLookupError):  # nothing of it is left
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def hold_ctest(self):
        """Lets ctest write its process id into a pipe and then wait for a line in another; returns both paths."""
        begun, go = self.stubs.folder / "begun", self.stubs.folder / "go"
        os.mkfifo(begun)
        os.mkfifo(go)
        self.stubs.add("ctest", f"echo $$ >{begun}; read line <{go}\n" + self.CTEST)
        return begun, go

    def test_all_is_well(self):
        code, text = self.run_test()
        self.assertEqual(code, 0, text)
        self.assertIn("gate: 3 test cases ran, 3 are expected\n", text)

    def test_no_namespaces(self):
        self.stubs.add("unshare", "echo 'unshare: unshare failed: Operation not permitted' >&2; exit 1")
        for words in ([], ["all"]):
            code, text = self.run_test(*words)
            self.assertEqual(code, 77, text)
            self.assertIn("Operation not permitted", text)
            self.assertIn("sysctl kernel.unprivileged_userns_clone=1", text)
        self.assertNotIn("ctest", self.stubs.called())

    def test_build_folder_is_read_only(self):
        (self.tree / "build").write_text("in the way\n")
        code, text = self.run_test()
        self.assertEqual((code, text), (73, f"test: {self.tree}/build cannot be written to; tests are built there\n"))

    def test_compilation_fails(self):
        self.stubs.add("build", "exit 3", self.tree / "tools")
        self.assertEqual(self.run_test()[0], 3)
        self.assertNotIn("ctest", self.stubs.called())

    def test_an_interrupted_run_leaves_nothing(self):
        begun, _ = self.hold_ctest()
        process = self.start_test()
        ctest = int(begun.read_text())
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        process.communicate(timeout=HUNG_S)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertFalse(pathlib.Path("/proc", str(ctest)).exists())
        self.stubs.add("ctest", self.CTEST)
        code, text = self.run_test()
        self.assertEqual(code, 0, text)
        self.assertNotIn("another one runs", text)

    def test_the_second_of_two_waits(self):
        begun, go = self.hold_ctest()
        first = self.start_test()
        begun.read_text()
        second = self.start_test()
        self.assertEqual(second.stdout.readline(), "test: another one runs in this tree; this one waits for it\n")
        for process in (first, second):
            for turn in range(3):
                if process is not first or turn > 0:
                    begun.read_text()
                go.write_text("\n")
            text = process.communicate(timeout=HUNG_S)[0]
            self.assertEqual(process.returncode, 0, text)


class Tally(unittest.TestCase):
    """tests/support/tally.py on results made up here."""

    OUTPUT = {"GoogleTest": "[==========] 3 tests from 2 test suites ran. (1 ms total)\n",
              "GoogleTest, one left out": "[==========] 3 tests from 1 test suite ran. (1 ms total)\n[  SKIPPED ] A.B (0 ms)\n",
              "unittest": "test_a (x) ... ok\n----\nRan 2 tests in 0.1s\n",
              "unittest, one left out": "test_a (x) ... skipped 'no pip'\nRan 2 tests in 0.1s\nOK (skipped=1)\n",
              "a command": "checked\n"}

    def test_cases_are_counted(self):
        for kind, number in zip(self.OUTPUT, (3, 2, 2, 1, 1)):
            code, text = run_python("-c", f"import tally; print(tally.cases_of({self.OUTPUT[kind]!r})[0])")
            self.assertEqual((kind, code, text), (kind, 0, f"{number}\n"))

    def gate(self, results, expected):
        """tally.py gate in a tree of its own: (exit code, output)."""
        with tempfile.TemporaryDirectory() as folder:
            support = pathlib.Path(folder, "tests", "support")
            support.mkdir(parents=True)
            (support / "tally.py").write_bytes((SUPPORT / "tally.py").read_bytes())
            (support.parent / "gate.txt").write_text(expected)
            build = pathlib.Path(folder, "build", "release")
            build.mkdir(parents=True)
            cases = "".join(f'<testcase name="{name}" time="1" status="{status}"><system-out>{text}</system-out></testcase>'
                            for name, status, text in results)
            (build / "tests.xml").write_text(f"<testsuite>{cases}</testsuite>")
            done = subprocess.run([sys.executable, "-B", support / "tally.py", "gate", "release"], capture_output=True, text=True)
            return done.returncode, done.stdout

    def test_fewer_than_expected_is_a_failure(self):
        three, skipped = self.OUTPUT["GoogleTest"], self.OUTPUT["unittest, one left out"]
        self.assertEqual(self.gate([("ring", "run", three)], "release ring 3\n"), (0, "gate: 3 test cases ran, 3 are expected\n"))
        for results, expected, line in (
                ([("ring", "run", three)], "release ring 4\n", "missing: release ring: 3 of 4 cases ran"),
                ([("ring", "run", three)], "release ring 3\nrelease lens 9\n", "missing: release lens: 0 of 9 cases ran"),
                ([("pip", "run", skipped)], "release pip 1\n", "missing: release pip: test_a (x) ... skipped 'no pip'"),
                ([("ring", "fail", three)], "release ring 3\n", "failed: release ring")):
            code, text = self.gate(results, expected)
            self.assertEqual(code, 1, text)
            self.assertIn(f"gate: {line}\n", text)

    def test_more_than_expected_is_said(self):
        code, text = self.gate([("ring", "run", self.OUTPUT["GoogleTest"])], "release ring 1\n")
        self.assertEqual(code, 0)
        self.assertIn("2 of them are not in tests/gate.txt yet", text)


class ListedFaults(unittest.TestCase):
    def test_each_fits_the_sources(self):
        edits = [one[2:3] + one[4:6] for room in mutations.ROOMS.values() for one in room]
        edits += [one for fault in past_faults.FAULTS for one in fault.edits]
        for file, old, new in edits:
            self.assertEqual((SOURCE / file).read_text().count(old), 1, f"{file}: {old}")
            self.assertNotEqual(old, new)


class RandomMutations(unittest.TestCase):
    def test_a_condition_a_constant_or_a_call_is_removed(self):
        line = "  if (isOver(a) && b > 16) return 0;"
        self.assertEqual(list(random_mutations.conditions(line)),
                         ["  if (true || (isOver(a) && b > 16)) return 0;", "  if (false && (isOver(a) && b > 16)) return 0;"])
        self.assertEqual(list(random_mutations.constants(line)),
                         ["  if (isOver(a) && b > 0) return 0;", "  if (isOver(a) && b > 16) return 1;"])
        self.assertEqual(list(random_mutations.calls(line)), [])
        self.assertEqual(list(random_mutations.calls("  gate_->restart();")), ["  ;"])
        self.assertEqual(list(random_mutations.calls("  look_ns_ = 0;")), ["  ;"])
        for whole in ("  return f(a);", "  const int a = f();", "  call(a, [b] {", "  std::uint16_t a;"):
            self.assertEqual(list(random_mutations.calls(whole)) + list(random_mutations.conditions(whole)), [], whole)

    def test_each_changes_one_line_and_can_be_repeated(self):
        two = [random_mutations.drawn(20), random_mutations.drawn(20)]
        self.assertEqual(*two)
        self.assertEqual(len(two[0]), 40)
        for one in two[0]:
            file, before, after = random_mutations.edit(SOURCE, one)
            self.assertEqual(before, (SOURCE / file).read_text())
            changed = [(a, b) for a, b in zip(before.splitlines(), after.splitlines(), strict=True) if a != b]
            self.assertEqual(changed, [(one.old, one.new)])


if __name__ == "__main__":
    unittest.main()

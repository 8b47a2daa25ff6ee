"""The examples are built against the installed library, as a user would, and run."""

import os
import pathlib
import subprocess
import tempfile
import unittest

from ctl import answer
from publisher import Publisher

BUILD = os.environ["TRACTION_BUILD"]
EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "client" / "examples"


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)
    if done.returncode:
        raise AssertionError(f"{command}: {done.stdout}")
    return done.stdout


class Installed(unittest.TestCase):
    def test_example_builds_and_receives(self):
        with tempfile.TemporaryDirectory(prefix="traction-") as folder:
            prefix, build = pathlib.Path(folder, "prefix"), pathlib.Path(folder, "build")
            run("cmake", "--install", BUILD, "--prefix", prefix, "--component", "client")
            run("cmake", "-S", EXAMPLES, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}")
            run("cmake", "--build", build)

            publisher = Publisher(answer)
            self.addCleanup(publisher.close)
            endpoint = publisher.endpoint(publisher.stream)
            output = run(build / "print_resultant", endpoint, "3", timeout=120)
            self.assertEqual(output, "+1.500 -2.500 +3.500 N\n" * 3)
            output = run(build / "print_status", publisher.endpoint(publisher.control), timeout=120)
            self.assertEqual(output, "10 received, 7 published, 3 stale\n")
            output = run(prefix / "bin" / "tractionctl", "echo", "--connect", endpoint, "--count", "1", timeout=120)
            self.assertIn('"resultant_N":[1.5,-2.5,3.5]', output)

    def test_headers_need_nothing_but_the_standard_library(self):
        include = EXAMPLES.parent / "include"
        for header in sorted(include.rglob("*.h")):
            for standard in ("c++17", "c++20"):
                run(os.environ["CXX"], f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only",
                    "-I", include, "-include", header, "-x", "c++", "/dev/null")
            text = header.read_text()
            self.assertNotIn("zmq", text.replace("ZeroMQ", ""), header)
            self.assertNotIn("google", text, header)

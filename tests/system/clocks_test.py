"""Clocks that are set while frames come: the camera's, and the time of day. What is said of the time of capture is true."""

import os
import pathlib
import subprocess
import unittest

TESTS = ["quirks_test", "--gtest_filter=Latching.*:Timed.*"], ["capture_test", "--gtest_filter=ClockSimulation.*"]


class Clocks(unittest.TestCase):
    def test_what_is_said_of_the_time_of_capture(self):
        for program, choice in TESTS:
            path = pathlib.Path(os.environ["TRACTION_BUILD"]) / "bin" / program
            done = subprocess.run([path, choice], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
            print("\n".join(line for line in done.stdout.splitlines() if line.startswith("  ")))
            self.assertEqual(done.returncode, 0, done.stdout)

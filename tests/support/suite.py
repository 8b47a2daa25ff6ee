"""Marks tests that are not in the gate, and runs one part of a file of tests.

usage: suite.py unmarked|statistics|realtime|minutes|npm|every MODULE[.CLASS[.TEST]]...
Ends with 0 if all passed and there was at least one, 1 otherwise.
"""

import sys
import unittest


def _marker(part):
    def mark(test):
        test.part = part
        return test
    return mark


statistics = _marker("statistics")  # bounds shares, variances or coverage of random draws
realtime = _marker("realtime")  # bounds times, rates or memory, or counts what real-time threads deliver
minutes = _marker("minutes")  # computes for longer than the gate may
npm = _marker("npm")  # needs what npm brings, which a machine may not reach


def part_of(test):
    """Returns the mark of a test, else that of its class, else None."""
    method = getattr(test, test._testMethodName, None)
    return getattr(method, "part", None) or getattr(type(test), "part", None)


def select(tests, part):
    """Returns those of a suite's tests that belong to the part. A test that could not be loaded belongs to every part."""
    if isinstance(tests, unittest.TestSuite):
        return unittest.TestSuite(select(each, part) for each in tests)
    chosen = part == "every" or part_of(tests) == (None if part == "unmarked" else part)
    return unittest.TestSuite([tests] if chosen or type(tests).__name__ == "_FailedTest" else [])


def main(part, *names):
    tests = select(unittest.defaultTestLoader.loadTestsFromNames(names), part)
    result = unittest.TextTestRunner(verbosity=2).run(tests)
    return 0 if result.wasSuccessful() and result.testsRun else 1


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("unmarked", "statistics", "realtime", "minutes", "npm", "every"):
        print(__doc__, file=sys.stderr)
        sys.exit(64)
    sys.path.insert(0, "")
    sys.exit(main(*sys.argv[1:]))

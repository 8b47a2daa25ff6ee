"""Tests of programs that keep time, on a machine that may itself stand still."""

import unittest

import pauses

STEADY_S = 0.05  # longest pause at which twin, daemon and subscribers lose nothing
RUNS = 3


class Kept(unittest.TestResult):
    """What a test said, for whoever it is told."""

    def __init__(self):
        super().__init__()
        self.told = []

    def tell(self, result):
        for name, arguments in self.told:
            getattr(result, name)(*arguments)


def keep(name):
    def kept(self, *arguments):
        self.told.append((name, arguments))
        getattr(unittest.TestResult, name)(self, *arguments)
    return kept


for each in ("addError", "addFailure", "addSubTest", "addSuccess", "addSkip", "addExpectedFailure", "addUnexpectedSuccess"):
    setattr(Kept, each, keep(each))


class TestCase(unittest.TestCase):
    """One that fails while the machine stands still says nothing of the programs: it runs again, up to three times in all, and
    it is said. What the last run says, holds."""

    def run(self, result=None):
        if result is None:
            return super().run()
        result.startTest(self)
        for attempt in range(1, RUNS + 1):
            kept = Kept()
            with pauses.Pauses() as machine:
                super().run(kept)
            if kept.wasSuccessful() or machine.longest < STEADY_S:
                break
            if attempt < RUNS:
                print(f"\n  The machine itself stood still for {machine.longest:.2f} s: run {attempt + 1} of at most {RUNS} "
                      f"follows what failed:\n{(kept.errors + kept.failures)[0][1]}", flush=True)
        kept.tell(result)
        result.stopTest(self)
        return result

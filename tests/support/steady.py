"""Tests of programs that keep time, on a machine that may itself stand still."""

import os
import threading
import time

import rig

STEADY_S = 0.05  # longest pause at which twin, daemon and subscribers lose nothing


class Pauses:
    """The longest time [s] for which one that wants a moment now and then was not let run, on any processor: the machine's,
    nobody's stall."""

    EVERY_S = 0.02

    def __init__(self):
        self.over, self.longest = threading.Event(), 0.0

    def __enter__(self):
        self.threads = [threading.Thread(target=self.watch, args=[cpu]) for cpu in os.sched_getaffinity(0)]
        for thread in self.threads:
            thread.start()
        return self

    def watch(self, cpu):
        os.sched_setaffinity(threading.get_native_id(), [cpu])
        while not self.over.is_set():
            begin = time.monotonic()
            self.over.wait(self.EVERY_S)
            self.longest = max(self.longest, time.monotonic() - begin - self.EVERY_S)

    def __exit__(self, *_):
        self.over.set()
        for thread in self.threads:
            thread.join()


class TestCase(rig.TestCase):
    """Says how long the machine stood still, if that was long enough to lose something: a failure then says nothing of the
    programs."""

    def run(self, result=None):
        with Pauses() as machine:
            result = super().run(result)
        if machine.longest >= STEADY_S:
            print(f"\n  The machine itself stood still for {machine.longest:.2f} s", flush=True)
        return result

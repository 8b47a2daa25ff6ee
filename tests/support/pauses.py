"""How long the machine itself stands still, or lets somebody wait."""

import os
import pathlib
import threading
import time


class Pauses:
    """When, and for how long, one that wants a moment now and then was not let run, on any processor: the machine's, nobody's
    stall."""

    def __init__(self, noted=0.05):
        self.noted, self.over = noted, threading.Event()
        self.longest = 0.0
        self.found = []  # (begin, length) of those that are noted

    def __enter__(self):
        self.threads = [threading.Thread(target=self.watch, args=[cpu]) for cpu in os.sched_getaffinity(0)]
        for thread in self.threads:
            thread.start()
        return self

    def watch(self, cpu, every=0.02):
        os.sched_setaffinity(threading.get_native_id(), [cpu])
        while not self.over.is_set():
            begin = time.monotonic()
            self.over.wait(every)
            length = time.monotonic() - begin - every
            self.longest = max(self.longest, length)
            if length > self.noted:
                self.found.append((begin, length))

    def longest_since(self, begin):
        return max((length for at, length in self.found if at + length > begin), default=0.0)

    def __exit__(self, *_):
        self.over.set()
        for thread in self.threads:
            thread.join()


def waited(pid):
    """Thread id -> how long it has waited for a processor since it began [s]."""
    found = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        try:
            found[task.name] = 1e-9 * int((task / "schedstat").read_text().split()[1])
        except OSError:  # it has ended
            continue
    return found

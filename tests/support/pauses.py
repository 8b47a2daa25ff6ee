"""How long the machine itself stands still."""

import os
import threading
import time


class Pauses:
    """For how long one that wants a moment now and then was not let run, on any processor: the machine's, nobody's stall."""

    def __init__(self):
        self.over = threading.Event()
        self.longest = 0.0

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

    def __exit__(self, *_):
        self.over.set()
        for thread in self.threads:
            thread.join()

"""What systemd does with a program that exceeds MemoryMax= or dies, by the values of its unit."""

import re
import signal
import threading
import time

import rig


class Unit:
    """Keeps a program running while this is entered. `died` and `ready`: when it ended and was ready again (time.monotonic())."""

    def __init__(self, name, start, memory_MiB=None):
        """`name` of the unit's file; `start` returns the program, ready; `memory_MiB`: a limit as an operator may set it."""
        text = (rig.SOURCE / f"systemd/{name}@.service.in").read_text()
        number, unit = re.search(r"(?m)^MemoryMax=(\d+)([MG])$", text).groups()
        self.memory_MiB = memory_MiB or int(number) * {"M": 1, "G": 1024}[unit]
        self.pause_s = float(re.search(r"(?m)^RestartSec=([\d.]+)$", text)[1])
        self.start, self.process, self.over = start, start(), threading.Event()
        self.died, self.ready, self.peak_MiB = [], [], 0.0
        self.thread = threading.Thread(target=self.follow)

    def follow(self):
        while not self.over.wait(0.005):
            if self.process.child.poll() is None:
                self.peak_MiB = max(self.peak_MiB, self.process.memory_MiB())
                if self.process.memory_MiB() > self.memory_MiB:
                    self.process.child.send_signal(signal.SIGKILL)
                continue
            self.died.append(time.monotonic())
            time.sleep(self.pause_s)
            self.process = self.start()
            self.ready.append(time.monotonic())

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()

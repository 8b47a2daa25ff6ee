"""What a process takes of the processors, and one that takes as much and does nothing else: what a flood costs others by being
computed on their machine is told apart from what it does to the program that is flooded.

usage: burner.py SECONDS PROCESSORS    takes so many processors (0.7, 1.5), evenly
"""

import math
import os
import pathlib
import sys
import time

SLICE_S = 0.01


class Share:
    """`processors` is what a process took of them while this was entered."""

    def __init__(self, process):
        self.stat = pathlib.Path(f"/proc/{process.child.pid}/stat")
        self.processors = 0.0

    def taken_s(self):
        user, system = self.stat.read_text().rsplit(")", 1)[1].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def __enter__(self):
        self.begin, self.taken_before_s = time.monotonic(), self.taken_s()
        return self

    def __exit__(self, *_):
        self.processors = (self.taken_s() - self.taken_before_s) / (time.monotonic() - self.begin)


def burn(seconds, share):
    """Takes this share of one processor."""
    end = time.monotonic() + seconds
    while (begin := time.monotonic()) < end:
        while time.monotonic() < begin + share * SLICE_S:
            pass
        time.sleep(max(0.0, begin + SLICE_S - time.monotonic()))


if __name__ == "__main__":
    SECONDS, PROCESSORS = map(float, sys.argv[1:])
    print("burning", flush=True)
    count = max(1, math.ceil(PROCESSORS))
    for _ in range(count - 1):
        if os.fork() == 0:
            break
    burn(SECONDS, PROCESSORS / count)

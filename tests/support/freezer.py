"""Stops one thread of a process, as a bug or a driver would: kill -STOP stops them all."""

import ctypes
import os
import pathlib
import threading

SEIZE, INTERRUPT, DETACH = 0x4206, 0x4207, 17


class Frozen:
    """While it lasts; or until the process has ended. ptrace(2) wants all calls from one thread."""

    def __init__(self, tid):
        self.tid = tid
        self.frozen, self.enough = threading.Event(), threading.Event()
        self.error = None
        self.thread = threading.Thread(target=self.hold)

    def hold(self):
        libc = ctypes.CDLL(None, use_errno=True)
        libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        if libc.ptrace(SEIZE, self.tid, None, None) != 0 or libc.ptrace(INTERRUPT, self.tid, None, None) != 0:
            self.error = OSError(ctypes.get_errno(), "ptrace")
        else:
            os.waitpid(self.tid, 0x40000000)  # __WALL
        self.frozen.set()
        self.enough.wait()
        libc.ptrace(DETACH, self.tid, None, None)

    def __enter__(self):
        self.thread.start()
        self.frozen.wait()
        if self.error is not None:
            self.__exit__()
            raise self.error
        return self

    def __exit__(self, *_):
        self.enough.set()
        self.thread.join()


def threads(pid):
    """Thread id -> name."""
    tasks = pathlib.Path(f"/proc/{pid}/task")
    return {int(one.name): (one / "comm").read_text().strip() for one in tasks.iterdir()}

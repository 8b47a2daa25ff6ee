"""A cable to a network namespace of its own, in which a camera can live, and what goes wrong with cables.

usage: wire.py NEAR FAR SEED [FAR...]: addresses of a /24. It says "ready" when both ends are up; its namespace is the far
one. A line of JSON on its standard input sets some of these, others stay:
    {"loss": share, "twice": share, "late": share, "late_ms": at most, "cut": true: nothing passes, "carrier": false}
"""

import contextlib
import ctypes
import fcntl
import heapq
import json
import os
import random
import select
import struct
import subprocess
import sys
import time

SET_INTERFACE, SET_CARRIER, TAP, NO_HEADER, NEW_NETWORK = 0x400454CA, 0x400454E2, 0x2, 0x1000, 0x40000000
NEAR_NAME, FAR_NAME = "cable", "camera"


def plug(name, *addresses):
    """An Ethernet interface of this namespace, whose packets are read and written here."""
    end = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(end, SET_INTERFACE, struct.pack("16sH22x", name.encode(), TAP | NO_HEADER))
    for address in addresses:
        subprocess.run(["ip", "address", "add", f"{address}/24", "broadcast", "+", "dev", name], check=True)
    subprocess.run(["ip", "link", "set", name, "mtu", "9000", "txqueuelen", "10000", "up"], check=True)
    return end


def main():
    near_address, far_address, seed, *more = sys.argv[1:]
    fate = random.Random(int(seed))
    near = plug(NEAR_NAME, near_address)
    if ctypes.CDLL(None, use_errno=True).unshare(NEW_NETWORK) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    far = plug(FAR_NAME, far_address, *more)
    other = {near: far, far: near}
    state = {"loss": 0.0, "twice": 0.0, "late": 0.0, "late_ms": 5.0, "cut": False, "carrier": True}
    late = []  # (when, number, end, packet)
    number = 0
    print("ready", flush=True)

    def put(end, packet):
        with contextlib.suppress(OSError):  # it is down, or full
            os.write(end, packet)

    while True:
        wait = max(0.0, late[0][0] - time.monotonic()) if late else None
        ready = select.select([sys.stdin, near, far], [], [], wait)[0]
        while late and late[0][0] <= time.monotonic():
            put(*heapq.heappop(late)[2:])
        for end in ready:
            if end is sys.stdin:
                line = sys.stdin.buffer.raw.readline()
                if not line:
                    return
                before = state["carrier"]
                state.update(json.loads(line))
                if state["carrier"] != before:
                    for one in other:
                        fcntl.ioctl(one, SET_CARRIER, struct.pack("i", state["carrier"]))
                continue
            for _ in range(64):
                try:
                    packet = os.read(end, 65536)
                except OSError:
                    break
                if state["cut"] or (state["loss"] and fate.random() < state["loss"]):
                    continue
                for _ in range(2 if state["twice"] and fate.random() < state["twice"] else 1):
                    if state["late"] and fate.random() < state["late"]:
                        number += 1
                        due = time.monotonic() + 1e-3 * fate.uniform(0, state["late_ms"])
                        heapq.heappush(late, (due, number, other[end], packet))
                    else:
                        put(other[end], packet)


main()

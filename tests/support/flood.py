"""Floods a gateway from 127.0.0.2. usage: flood.py KIND SECONDS STREAM LATEST CONTROL SERVER_KEY PUBLIC SECRET"""

import contextlib
import os
import resource
import selectors
import socket
import sys
import time

import zmq

import seed

KIND, SECONDS, PORTS, KEYS = sys.argv[1], float(sys.argv[2]), [int(port) for port in sys.argv[3:6]], sys.argv[6:9]
GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"CURVE".ljust(20, b"\0") + bytes(32)
HELLO = b"\x04\xc8\x05HELLO\x01\x00" + bytes(72)  # its length; what follows is random
DRAW = seed.chance("flood", *sys.argv[1:3])  # kind and seconds
STATUS, SNAPSHOT = b"\x08\x01\x12\x00", b"\x08\x01\x3a\x00"  # traction.v1.Request


def raw(first, at_a_time=1500):
    """Connections that say `first` (a function) and nothing else, always so many; made anew when they are ended."""
    count, open_ones, end = 0, selectors.DefaultSelector(), time.monotonic() + SECONDS
    while time.monotonic() < end:
        for _ in range(min(50, at_a_time - len(open_ones.get_map()))):
            one = socket.socket()
            one.bind(("127.0.0.2", 0))
            one.settimeout(0.5)
            try:
                one.connect(("127.0.0.1", DRAW.choice(PORTS)))
                one.setblocking(False)
                one.send(first())
            except OSError:
                one.close()
                continue
            count += 1
            open_ones.register(one, selectors.EVENT_READ)
        for key, _ in open_ones.select(0):
            with contextlib.suppress(BlockingIOError):
                try:
                    over = not key.fileobj.recv(65536)
                except ConnectionError:
                    over = True
                if over:
                    open_ones.unregister(key.fileobj)
                    key.fileobj.close()
    return f"{count} connections"


def allowed(kind, port):
    peer = zmq.Context.instance().socket(kind)
    peer.linger, peer.sndhwm, peer.rcvhwm = 0, 100000, 10
    peer.curve_serverkey, peer.curve_publickey, peer.curve_secretkey = (key.encode() for key in KEYS)
    peer.connect(f"tcp://127.0.0.2:0;127.0.0.1:{port}")
    return peer


def subscriptions():
    count, end, peers = 0, time.monotonic() + SECONDS, [allowed(zmq.XSUB, port) for port in PORTS[:2]]
    while time.monotonic() < end:
        for peer in peers:
            with contextlib.suppress(zmq.Again):
                peer.send(b"\x01" + DRAW.randbytes(400), zmq.DONTWAIT)
                count += 1
    return f"{count} subscriptions"


def requests(what):
    count, end, peer = 0, time.monotonic() + SECONDS, allowed(zmq.DEALER, PORTS[2])
    while time.monotonic() < end:
        with contextlib.suppress(zmq.Again):
            peer.send_multipart([b"", what], zmq.DONTWAIT)
            count += 1
    return f"{count} requests"


def connections():
    """Whole handshakes of an allowed key, again and again."""
    count, end = 0, time.monotonic() + SECONDS
    while time.monotonic() < end:
        peers = []
        with contextlib.suppress(zmq.ZMQError):  # those before are still being closed, and no descriptor is left
            for _ in range(20):
                peers.append(allowed(zmq.SUB, DRAW.choice(PORTS[:2])))
        time.sleep(0.05)
        for peer in peers:
            peer.close()
        count += len(peers)
    return f"{count} connections"


resource.setrlimit(resource.RLIMIT_NOFILE, 2 * resource.getrlimit(resource.RLIMIT_NOFILE)[1:])
print("flooding", flush=True)
print({"silence": lambda: raw(lambda: b""),
       "junk": lambda: raw(lambda: DRAW.randbytes(DRAW.randrange(1, 600))),
       "handshakes": lambda: raw(lambda: GREETING + HELLO + DRAW.randbytes(120)),
       "connections": connections,
       "subscriptions": subscriptions,
       "requests": lambda: requests(STATUS),
       "snapshots": lambda: requests(SNAPSHOT)}[KIND]())
sys.stdout.flush()
os._exit(0)

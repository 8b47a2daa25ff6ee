"""Peers that make ZeroMQ collect what they send, or take its file descriptors.

usage: hoard.py parts SECONDS ENDPOINT TYPE               one connection at a time: parts of a message that does not end
       hoard.py keyed SECONDS ENDPOINT TYPE KEY...        the same with a key for a gateway
       hoard.py thousand SECONDS ENDPOINT TYPE            1,000 connections: the same, each a little below what one may hold
       hoard.py subscriptions SECONDS ENDPOINT KEY...     random subscriptions of 400 bytes, with a key for a gateway
       hoard.py snapshots SECONDS ENDPOINT [KEY...]       30 connections that ask for pictures and read none
       hoard.py silent SECONDS ENDPOINT...                up to 6,000 connections at a time that say nothing
       hoard.py greeted SECONDS ENDPOINT...               the same, that shake hands (without a key) and say nothing else
KEY...: the server's public key, and a pair.
"""

import collections
import contextlib
import itertools
import os
import resource
import sys
import time

import seed
import zmq
import zmtp

KIND, SECONDS, ENDPOINT, *REST = sys.argv[1:]
END = time.monotonic() + float(SECONDS)
DRAW = seed.chance("hoard", *sys.argv[1:3])
SNAPSHOT = b"\x08\x01\x3a\x00"  # traction.v1.Request
PART = zmtp.frame(b"x", more=True)


def peer():
    while time.monotonic() < END:
        with contextlib.suppress(OSError):  # ended at once, as others before it
            return zmtp.Peer(ENDPOINT, REST[0])


def parts():
    sent = connections = 0
    while (one := peer()) is not None:
        connections += 1
        while time.monotonic() < END and (count := one.send(PART * 20000)):
            sent += count
            if count < 20000 * len(PART):
                break
        one.close()
    return f"{connections} connections, {sent / 2**20:.1f} MiB of parts"


def keyed():
    sent = connections = 0
    while time.monotonic() < END:
        try:
            one = zmtp.CurvePeer(ENDPOINT, REST[0], REST[1:])
        except OSError:
            continue
        connections += 1
        while time.monotonic() < END:
            some = b"".join(one.message(b"x", more=True) for _ in range(1000))
            count = one.send(some)
            sent += count
            if count < len(some):
                break
        one.close()
    return f"{connections} connections, {sent / 2**20:.1f} MiB of parts"


def thousand():
    peers, sent = [], 0
    while len(peers) < 1000 and (one := peer()) is not None:
        peers.append(one)
        sent += one.send(PART * 15000)
    time.sleep(max(0.0, END - time.monotonic()))
    return f"{len(peers)} connections, {sent / 2**20:.1f} MiB of parts"


def allowed(kind):
    one = zmq.Context.instance().socket(kind)
    one.linger, one.sndhwm, one.rcvhwm = 0, 100000, 1
    if REST:
        one.curve_serverkey, one.curve_publickey, one.curve_secretkey = (key.encode() for key in REST)
    one.connect(ENDPOINT)
    return one


def subscriptions():
    one, count = allowed(zmq.XSUB), 0
    while time.monotonic() < END:
        with contextlib.suppress(zmq.Again):
            one.send(b"\x01" + DRAW.randbytes(400), zmq.DONTWAIT)
            count += 1
    return f"{count} subscriptions"


def snapshots():
    peers, count = [allowed(zmq.DEALER) for _ in range(30)], 0
    while time.monotonic() < END:
        for one in peers:
            with contextlib.suppress(zmq.Again):
                one.send_multipart([b"", SNAPSHOT], zmq.DONTWAIT)
                count += 1
        time.sleep(0.05)
    return f"{count} requests"


def hold(connect):
    """Connects to one endpoint after another, and closes the oldest of too many connections."""
    endpoints, held, made, failed = itertools.cycle([ENDPOINT, *REST]), collections.deque(), 0, 0
    while time.monotonic() < END:
        try:
            held.append(connect(next(endpoints)))
            made += 1
        except OSError:  # refused, or ended before its handshake was done
            failed += 1
        if len(held) > 6000:
            held.popleft().close()
    return f"{made} connections, {failed} failed"


def silent():
    return hold(lambda endpoint: zmtp.connect(endpoint, seconds=0.2))


def greeted():
    return hold(lambda endpoint: zmtp.Peer(endpoint, "SUB", seconds=0.2))


resource.setrlimit(resource.RLIMIT_NOFILE, 2 * resource.getrlimit(resource.RLIMIT_NOFILE)[1:])
print("hoarding", flush=True)
print({"parts": parts, "keyed": keyed, "thousand": thousand, "subscriptions": subscriptions, "snapshots": snapshots,
       "silent": silent, "greeted": greeted}[KIND]())
sys.stdout.flush()
os._exit(0)

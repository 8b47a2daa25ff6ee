"""Datagrams that no camera sent, at a steady rate: whole pictures, packets that once ended a driver, and packets of the
stream and of the control channel with bytes changed at random.
usage: datagrams.py SEED RATE SECONDS SOURCE PORT..."""

import random
import sys
import time

import rig

WIDTH, HEIGHT = 640, 480
PACKET = 8996 - 36


class Keeper:
    """What a forger would send."""

    def __init__(self):
        self.packets = []

    def sendto(self, data, _):
        self.packets.append(data)


def forged(make):
    forger = rig.Forger.__new__(rig.Forger)
    forger.target, forger.socket = None, Keeper()
    make(forger)
    return forger.socket.packets


def crafted(forger, draw):
    forger.raw(bytes([0, 0, 0, 0, 0x82] + 10 * [0] + [1, 0xff, 0xff, 0xff, 0xfe]))  # 64 GB, by its number
    forger.packet(7, draw.randrange(65536), 1, bytes(7))  # multipart
    forger.packet(forger.TRAILER, draw.randrange(65536), 0xfffffe, bytes(8))
    frame = draw.randrange(65536)
    forger.packet(forger.TRAILER, frame, 0, bytes(8))
    forger.packet(forger.PAYLOAD, frame, 500, bytes(1000))
    forger.raw(bytes(6) + frame.to_bytes(2, "big") + bytes([0x83]) + bytes(50))  # ids of the other width
    forger.raw(bytes([0, 0, 0, 0x81, 0, 4]) + draw.randbytes(2) + bytes(4))  # a register that reads 0


def fuzzed(packet, draw):
    """Some bytes changed, mostly of its header, and often another length."""
    data = bytearray(packet)
    for _ in range(draw.choice((1, 1, 2, 4, 16))):
        data[min(int(draw.expovariate(0.1)), len(data) - 1)] = draw.choice((0, 1, 0x7f, 0x80, 0xfe, 0xff, draw.randrange(256)))
    if draw.random() < 0.3:
        del data[draw.randrange(1, len(data) + 1):]
    return bytes(data)


def main(seed, rate, seconds, source, *ports):
    draw = random.Random(int(seed))
    targets = [rig.Forger("127.0.0.1", int(port), source) for port in ports]
    picture = draw.randbytes(3 * WIDTH * HEIGHT)
    whole = forged(lambda forger: forger.frame(draw.randrange(65536), picture, WIDTH, HEIGHT, time.time_ns(), chunk=PACKET))
    print("sending", flush=True)
    begin, sent, changed = time.monotonic(), 0, 0
    while (now := time.monotonic()) < begin + float(seconds):
        while sent < (now - begin) * float(rate):
            if draw.random() < 0.02:
                packets = whole
            else:
                packets = forged(lambda forger: crafted(forger, draw))
                packets += [fuzzed(packet, draw) for packet in draw.choices(packets + whole[:2] + whole[-1:], k=60)]
                changed += 60
            for packet in packets:
                draw.choice(targets).raw(packet)
            sent += len(packets)
        time.sleep(0.002)
    print(sent, changed)


main(*sys.argv[1:])

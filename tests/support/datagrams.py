"""GigE Vision stream packets (GVSP 1.x, 16-bit block ids) that no camera sent, at a steady rate: whole pictures, packets that
once ended a driver, and packets of the stream and of the control channel with bytes changed at random.
usage: datagrams.py SEED RATE SECONDS SOURCE PORT..."""

import random
import socket
import sys
import time

WIDTH, HEIGHT = 640, 480
BYTES = 8996 - 36  # of picture in a packet of the default size
LEADER, TRAILER, PAYLOAD, MULTIPART = 1, 2, 3, 7
RGB8 = 0x02180014


def packet(kind, frame, number, body):
    return bytes(2) + frame.to_bytes(2, "big") + bytes([kind]) + number.to_bytes(3, "big") + body


def picture(frame, pixels):
    """Packets of a whole picture, captured now."""
    leader = ((1).to_bytes(4, "big") + time.time_ns().to_bytes(8, "big") + RGB8.to_bytes(4, "big") + WIDTH.to_bytes(4, "big") +
              HEIGHT.to_bytes(4, "big") + bytes(12))
    parts = [pixels[i:i + BYTES] for i in range(0, len(pixels), BYTES)]
    return [packet(LEADER, frame, 0, leader), *(packet(PAYLOAD, frame, n, part) for n, part in enumerate(parts, 1)),
            packet(TRAILER, frame, len(parts) + 1, (1).to_bytes(4, "big") + HEIGHT.to_bytes(4, "big"))]


def crafted(draw):
    frame = draw.randrange(65536)
    return [bytes([0, 0, 0, 0, 0x82] + 10 * [0] + [1, 0xff, 0xff, 0xff, 0xfe]),  # 64 GB, by its number
            packet(MULTIPART, draw.randrange(65536), 1, bytes(7)),
            packet(TRAILER, draw.randrange(65536), 0xfffffe, bytes(8)),
            packet(TRAILER, frame, 0, bytes(8)),
            packet(PAYLOAD, frame, 500, bytes(1000)),
            bytes(6) + frame.to_bytes(2, "big") + bytes([0x83]) + bytes(50),  # ids of the other width
            bytes([0, 0, 0, 0x81, 0, 4]) + draw.randbytes(2) + bytes(4)]  # a register that reads 0


def fuzzed(data, draw):
    """Some bytes changed, mostly of its header, and often another length."""
    data = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 4, 16))):
        data[min(int(draw.expovariate(0.1)), len(data) - 1)] = draw.choice((0, 1, 0x7f, 0x80, 0xfe, 0xff, draw.randrange(256)))
    if draw.random() < 0.3:
        del data[draw.randrange(1, len(data) + 1):]
    return bytes(data)


def main(seed, rate, seconds, source, *ports):
    draw = random.Random(int(seed))
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.bind((source, 0))
    whole = picture(draw.randrange(65536), draw.randbytes(3 * WIDTH * HEIGHT))
    print("sending", flush=True)
    begin, sent, changed = time.monotonic(), 0, 0
    while (now := time.monotonic()) < begin + float(seconds):
        while sent < (now - begin) * float(rate):
            packets = whole
            if draw.random() >= 0.02:
                packets = crafted(draw)
                packets += [fuzzed(each, draw) for each in draw.choices(packets + whole[:2] + whole[-1:], k=60)]
                changed += 60
            for each in packets:
                sender.sendto(each, ("127.0.0.1", int(draw.choice(ports))))
            sent += len(packets)
        time.sleep(0.002)
    print(sent, changed)


main(*sys.argv[1:])

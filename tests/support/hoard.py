"""A peer that makes ZeroMQ collect what it sends: parts of a message that does not end, until the other side has gone.

usage: hoard.py ENDPOINT
"""

import sys

import zmtp

PARTS = zmtp.frame(b"x", more=True) * 20_000

peer = zmtp.Peer(sys.argv[1], "DEALER")
print("hoarding", flush=True)
sent = 0
while (count := peer.send(PARTS)) == len(PARTS):
    sent += count
print(f"{(sent + count) / 2**20:.1f} MiB sent")

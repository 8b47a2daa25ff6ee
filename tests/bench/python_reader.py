"""Fields a second of the Python client: full messages into NumPy, one core for the reader, the publisher on another.
Prints a line of JSON. usage: python_reader.py"""

import json
import os
import pathlib
import random
import subprocess
import sys
import time

import zmq

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "client" / "python"), str(SOURCE / "tests" / "conformance")]
WARM, FIELDS = 2000, 20_000


def publish():
    """A full field, over and over, as fast as it is read. Where it does, is printed."""
    import cases
    chance = random.Random(1)
    one = cases.Sender(chance, "speed")
    values = one.make(count=576)
    nodes = range(3 * 576)
    contact = {"position_m": {"x": 0.01, "y": 0.02}, "position_deviation_m": {"x": 1e-5, "y": 1e-5}, "area_m2": 1e-4,
               "force_N": {"x": 0.1, "y": 0.2, "z": 1.0}, "force_deviation_N": {"x": 0.01, "y": 0.01, "z": 0.02}}
    values.update(contacts=[contact] * 2, force_N=[chance.gauss(0, 1) for _ in nodes],
                  node_deviation_N=[chance.random() for _ in nodes])
    values.update({name: {part: [chance.gauss(0, 1) for _ in range(9)] for part in ("noise", "systematic")} for name in (
        "resultant_covariance_N2", "moment_covariance_N2m2", "resultant_moment_covariance_N2m")})
    parts = one.parts("Field", cases.encode("Field", values))
    socket = zmq.Context().socket(zmq.XPUB)
    socket.xpub_nodrop = True  # waits for the reader
    socket.bind("tcp://127.0.0.1:*")
    print(json.dumps([socket.getsockopt_string(zmq.LAST_ENDPOINT), len(parts[1])]), flush=True)
    socket.recv()
    while True:
        socket.send_multipart(parts)


def main():
    import traction
    cores = sorted(os.sched_getaffinity(0))
    child = subprocess.Popen([sys.executable, __file__, "publish"], stdout=subprocess.PIPE)
    try:
        endpoint, size = json.loads(child.stdout.readline())
        os.sched_setaffinity(child.pid, {cores[-1]})
        os.sched_setaffinity(0, {cores[0]})
        fields = traction.fields(endpoint=endpoint)
        for _ in range(WARM):
            next(fields)
        begin, spent = time.monotonic(), time.process_time()
        for _ in range(FIELDS):
            field = next(fields)
        rate, spent = FIELDS / (time.monotonic() - begin), time.process_time() - spent
        assert field.force_N.shape == (576, 3)
    finally:
        child.kill()
        child.wait()
    print(json.dumps({"rate_hz": rate, "processor_us": 1e6 * spent / FIELDS, "bytes": size}))


publish() if "publish" in sys.argv[1:] else main()

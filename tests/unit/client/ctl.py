"""tractionctl run as a program, for its tests."""

import os
import pathlib
import signal
import subprocess
import threading
import unittest

import zmq
from deadline import HUNG_S
from publisher import Publisher
from traction.v1 import messages

PROGRAM = str(pathlib.Path(os.environ["TRACTION_BUILD"], "bin", "tractionctl"))
USAGE, NO_CAMERA, UNAVAILABLE, OUTPUT, TEMPORARY, PROTOCOL = 64, 66, 69, 74, 75, 76


def ctl(*words, seconds=HUNG_S):
    done = subprocess.run([PROGRAM, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=seconds,
                          env={**os.environ, "XDG_RUNTIME_DIR": "/nowhere"})
    return done.returncode, done.stdout, done.stderr


def answer(request):
    reply = messages.Reply(version=1)
    kind = request.WhichOneof("request")
    if kind == "status":
        reply.status.header.sensor = "gel"
        reply.status.camera = messages.CAMERA_STATE_STREAMING
        reply.status.ledger.received = 10
        reply.status.ledger.published = 7
        reply.status.ledger.stale = 3
        reply.status.rest_drift.shift_u_px = 0.125
    elif kind == "description":
        reply.description.software_version = "0.1.0"
    elif kind == "calibrate":
        step = request.calibrate.WhichOneof("step")
        figure = reply.calibrate.figures.add(name="value_of_" + step, value=2.0, deviation=0.5)
        if step == "weight":
            figure.name, figure.value = "weight_N", request.calibrate.weight.weight_N
            reply.calibrate.figures.add(name="first", value=request.calibrate.weight.first)
        reply.calibrate.remarks.append("a remark")
        reply.calibrate.path = "/gel.toml" if step == "finish" else ""
    else:
        reply.zero.zero.id = bytes(range(16))
        reply.zero.markers_present = 1150
        reply.zero.markers_expected = 1152
    return reply


class Case(unittest.TestCase):
    def publisher(self, reply=answer, **options):
        publisher = Publisher(reply, **options)
        self.addCleanup(publisher.close)
        return ["--connect", publisher.endpoint(publisher.stream), "--control", publisher.endpoint(publisher.control)]

    def socket(self, kind=zmq.XPUB, endpoint="tcp://127.0.0.1:*"):
        """A socket of a publisher that is none of ours, and its endpoint."""
        socket = self.enterContext(self.enterContext(zmq.Context()).socket(kind))
        socket.linger = 0
        socket.bind(endpoint)
        return socket, Publisher.endpoint(socket)

    def start(self, *words, **options):
        """Starts tractionctl, which is killed when the test ends, or when it hangs."""
        child = subprocess.Popen([PROGRAM, *words], **{"stdin": subprocess.DEVNULL, "stderr": subprocess.PIPE,
                                                        "text": True, "start_new_session": True, **options})
        self.addCleanup(self.end, child)
        hung = threading.Timer(HUNG_S, child.kill)
        hung.start()
        self.addCleanup(hung.cancel)
        return child

    @staticmethod
    def end(child):
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
        child.communicate()

    def fails(self, code, pattern, *words):
        """One line on standard error, nothing else."""
        returned, out, err = ctl(*words)
        self.assertEqual((returned, out), (code, ""), err)
        self.assertRegex(err, rf"\Atractionctl: .*{pattern}.*\n\Z")

    def ends(self, child, pattern):
        """Ends by itself, for standard output, with one line on standard error."""
        _, err = child.communicate(timeout=HUNG_S)
        self.assertEqual(child.returncode, OUTPUT, err)
        self.assertRegex(err, rf"\Atractionctl: .*{pattern}.*\n\Z")

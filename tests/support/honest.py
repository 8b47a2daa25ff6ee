"""Whom a soak believes: subscribers that read all that comes, and the cameras, which tell what they have shown."""

import collections
import json
import threading
import time

import numpy as np
import zmq

import rig

from traction.v1.options_pb2 import metric
from traction.v1.status_pb2 import Ledger

FLOWING = 10  # fields in a row
UNTRUE_N = 0.4  # a resultant that is further from the truth
BREAK_NS = 500_000_000  # between two fields for longer they do not flow
DISCONTINUITY = 4  # a flag that is no excuse for a wrong force
LOSSES = tuple(field.name for field in Ledger.DESCRIPTOR.fields
               if field.GetOptions().Extensions[metric].name == "frames_lost_total")


class Truth:
    """What the cameras of a soak say that they have shown, and whether that is what was published."""

    def __init__(self):
        self.files, self.rests, self.records, self.ends_ns = [], [], {}, []
        self.pending = collections.deque()
        self.newest_ns = 0  # that a camera has told of, by its own clock
        self.sent = self.checked = self.flagged = self.unrecorded = 0
        self.worst_N = 0.0
        self.invented, self.untrue, self.disordered = [], [], []

    def follow(self, path):
        self.files.append((path, None))
        self.rests.append(b"")

    def read(self):
        for i, (path, file) in enumerate(self.files):
            if file is None:
                if not path.exists():
                    continue
                file = open(path, "rb")
                self.files[i] = (path, file)
            *lines, self.rests[i] = (self.rests[i] + file.read()).split(b"\n")
            for line in lines:
                record = json.loads(line)
                self.records[record["camera_frame_id"], record["device_ns"]] = record["force_N"]
                self.newest_ns = max(self.newest_ns, record["device_ns"])
                self.sent += 1

    def camera_was_killed(self):
        """With -9: it may not have told of its last pictures."""
        self.ends_ns.append(time.time_ns())

    def check(self, all_of_them=False):
        """Of what was published more than two seconds ago, and is older than what a camera has told of since: it tells of its
        pictures one after another, on a busy machine late. Who is dead after half a minute has told all."""
        self.read()
        while self.pending:
            arrived, field = self.pending[0]
            age_s = time.monotonic() - arrived
            if not all_of_them and (age_s < 2 or (field.header.device_time_ns > self.newest_ns and age_s < 30)):
                break
            self.pending.popleft()
            header = field.header
            times = (header.received_ns, header.tracked_ns, header.solved_ns, header.sent_ns)
            if list(times) != sorted(times):
                self.disordered.append(header.frame_number)
            if header.flags & ~DISCONTINUITY or not field.valid:
                self.flagged += 1
                continue
            self.checked += 1
            force = self.records.get((header.camera_frame_id, header.device_time_ns))
            if force is None:
                if any(-0.1e9 < end - header.device_time_ns < 0.3e9 for end in self.ends_ns):
                    self.unrecorded += 1
                else:
                    self.invented.append(header.frame_number)
                continue
            wrong_N = float(np.linalg.norm(rig.vector(field.resultant_N) - force))
            self.worst_N = max(self.worst_N, wrong_N)
            if wrong_N > UNTRUE_N:
                self.untrue.append((header.frame_number, round(wrong_N, 2)))
        if len(self.records) > 20000:
            for key in list(self.records)[:10000]:
                del self.records[key]


class Reader(threading.Thread):
    """An honest subscriber: reads all that comes, at once, and keeps account."""

    def __init__(self, name, endpoint, keys=None, newest_only=False, told=None):
        super().__init__(daemon=True)
        self.name, self.told, self.newest_only, self.ending = name, told, newest_only, False
        self.fields, self.lost, self.field, self.status = 0, 0, None, None
        self.in_a_row = self.flows_since_ns = self.newest_ns = self.fault_ended_ns = 0
        self.boots, self.first, self.wrong = {}, None, []
        self.socket = zmq.Context.instance().socket(zmq.SUB)
        if newest_only:
            self.socket.conflate = True
        self.socket.rcvhwm = 100000
        if keys:
            self.socket.curve_serverkey, self.socket.curve_publickey, self.socket.curve_secretkey = (
                key.encode() for key in keys)
        self.socket.connect(endpoint)
        for topic in ("",) if newest_only else ("traction/v1/default/field/", "traction/v1/default/status/"):
            self.socket.subscribe(topic)

    def run(self):
        while not self.ending:
            if not self.socket.poll(100):
                continue
            *topic, payload = self.socket.recv_multipart()[:2]
            if topic and topic[0].endswith(b"/status/"):
                self.take_status(rig.messages.Status.FromString(payload))
            else:
                self.take(rig.messages.Field.FromString(payload))
        self.socket.close(0)

    def take(self, field):
        number, boot = field.header.sequence, field.header.boot
        before = self.boots.get(boot)
        if before is None:
            self.first = self.first or number
        elif number <= before:
            self.wrong.append(f"{self.name}: {number} after {before}")
        elif not self.newest_only:
            self.lost += number - before - 1
        self.boots[boot] = number
        self.fields += 1
        self.field = field
        if field.valid and field.header.received_ns > self.fault_ended_ns:
            now = time.monotonic_ns()
            if self.in_a_row == 0 or now - self.newest_ns > BREAK_NS:
                self.in_a_row, self.flows_since_ns = 0, now
            self.in_a_row += 1
            self.newest_ns = now
        if self.told is not None:
            self.told.append((time.monotonic(), field))

    def fault_ended(self):
        self.fault_ended_ns, self.in_a_row = time.monotonic_ns(), 0

    def recovered_after_s(self):
        """From the end of the fault to the first of the fields that have flown since; None: they do not flow yet."""
        return (self.flows_since_ns - self.fault_ended_ns) / 1e9 if self.in_a_row >= FLOWING else None

    def take_status(self, status):
        ledger = status.ledger
        if ledger.received != ledger.published + ledger.in_flight + sum(getattr(ledger, loss) for loss in LOSSES):
            self.wrong.append(f"{self.name}: the ledger does not balance: {ledger}")
        # One thread sends both on one socket, and nothing is lost: what it has counted we have got, and perhaps one more.
        got = self.boots.get(status.header.boot)
        if self.told is not None and got is not None and got - ledger.published not in (0, 1):
            self.wrong.append(f"{self.name}: {got} fields, and {ledger.published} published")
        self.status = status

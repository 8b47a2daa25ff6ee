"""A publisher of one sensor that has nothing of ours but the generated messages."""

import threading
import time

import zmq
from traction.v1 import messages


class Publisher:
    """Sends fields, and answers requests with what `reply` makes of them, until it is closed."""

    def __init__(self, reply=None, contacts=False):
        """`contacts`: sends those of a traction-touch, too, as a gateway forwards them."""
        self.contacts = contacts
        self.context = zmq.Context()
        self.stream = self.bind(zmq.PUB)
        self.control = self.bind(zmq.REP)
        self.reply = reply
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def bind(self, kind):
        socket = self.context.socket(kind)
        socket.linger = 0
        socket.bind("tcp://127.0.0.1:*")
        return socket

    @staticmethod
    def endpoint(socket):
        return socket.getsockopt_string(zmq.LAST_ENDPOINT)

    def run(self):
        sequence = 0
        while not self.stopping.wait(0.01):
            sequence += 1
            field = messages.Field(valid=True, valid_markers=1152)
            field.header.sequence = sequence
            field.header.sensor = "gel"
            field.header.boot = bytes(range(16))
            field.header.camera_frame_id = sequence % 65536
            field.header.received_ns = time.monotonic_ns()
            field.resultant_N.x, field.resultant_N.y, field.resultant_N.z = 1.5, -2.5, 3.5
            field.force_N.extend([0.0] * (3 * 576))
            field.node_valid = bytes([1] * 576)
            if self.contacts:
                contact = field.contacts.add(area_m2=1e-5, orientation_rad=0.5)
                contact.force_N.z, contact.moment_Nm.z = 3.5, 0.25
                contacts = messages.Contacts(valid=True, run=bytes(range(16)))
                contacts.header.CopyFrom(field.header)
                contact = contacts.contacts.add(id=4711, phase=2, seen_ns=10**9, radius_m=2e-3)
                contact.force_N.z = 3.5
                self.stream.send_multipart([b"traction/v1/gel/contacts/", contacts.SerializeToString(), b"0.0"])
            self.stream.send_multipart([b"traction/v1/gel/field/", field.SerializeToString(), b"0.0"])
            if self.reply and self.control.poll(0):
                request = messages.Request.FromString(self.control.recv())
                self.control.send(self.reply(request).SerializeToString())

    def close(self):
        self.stopping.set()
        self.thread.join()
        self.context.destroy(linger=0)

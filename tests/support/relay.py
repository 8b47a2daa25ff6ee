"""A GigE Vision camera at an address of its own, that is another one with faults: it passes packets to a camera behind it and
back, and changes, repeats or drops what a fault wants of the stream.
"""

import select
import socket
import threading

CONTROL_PORT = 3956
REGISTER_WRITE, DISCOVERY_ANSWER, RESEND_REQUEST = 0x0082, 0x0003, 0x0040
STREAM_PORT, STREAM_ADDRESS = 0x0D00, 0x0D18  # registers of the first stream channel: where the camera sends to
CURRENT_ADDRESS = 8 + 0x24  # in the answer to a discovery
LEADER, TRAILER, PAYLOAD = 1, 2, 3
IDS = 65535  # 16 bit, never 0


def udp(address, port=0):
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
    one.bind((address, port))
    one.setblocking(False)
    return one


class Relay:
    """A fault is a function `change(frame, packets)` of a whole frame: its number from the first on that was seen, and its
    packets. It returns the packets to send in their place.
    """

    def __init__(self, camera="127.0.0.1", own="127.0.0.2"):
        self.camera, self.own = camera, own
        self.change = None
        self.frames = 0  # seen
        self.silent = self.deaf = False  # no stream; no answers
        self.lost = set()  # ids as sent of frames whose packets are not sent again
        self.control, self.stream = udp(own, CONTROL_PORT), udp(own)
        self.clients = {}  # socket towards the camera -> address of the client
        self.target = None  # where the client wants the stream
        self.packets, self.of = [], None
        self.ended = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def close(self):
        self.ended = True
        self.thread.join()
        for one in (self.control, self.stream, *self.clients):
            one.close()

    def run(self):
        while not self.ended:
            for one in select.select([self.stream, self.control, *self.clients], [], [], 0.1)[0]:
                for _ in range(256):
                    try:
                        packet, source = one.recvfrom(65536)
                    except OSError:  # nothing more, or nobody behind it
                        break
                    if one is self.stream:
                        self.pass_picture(packet)
                    elif one is self.control:
                        self.pass_question(packet, source)
                    else:
                        self.pass_answer(packet, self.clients[one])

    def pass_question(self, packet, client):
        if self.deaf:
            return
        if int.from_bytes(packet[2:4], "big") == REGISTER_WRITE:
            packet = self.redirected(packet)
        if int.from_bytes(packet[2:4], "big") == RESEND_REQUEST and int.from_bytes(packet[10:12], "big") in self.lost:
            return
        towards = next((one for one, other in self.clients.items() if other == client), None)
        if towards is None:
            towards = udp(self.camera)
            self.clients[towards] = client
        self.send(towards, packet, (self.camera, CONTROL_PORT))

    def redirected(self, packet):
        """The client's stream comes here first."""
        body = bytearray(packet[8:])
        for at in range(0, len(body) - 7, 8):
            register, value = int.from_bytes(body[at:at + 4], "big"), int.from_bytes(body[at + 4:at + 8], "big")
            address, port = self.target or ("", 0)
            if register == STREAM_PORT:
                port = value & 0xFFFF
                if port:
                    body[at + 6:at + 8] = self.stream.getsockname()[1].to_bytes(2, "big")
            elif register == STREAM_ADDRESS:
                address = socket.inet_ntoa(value.to_bytes(4, "big"))
                if value:
                    body[at + 4:at + 8] = socket.inet_aton(self.own)
            else:
                continue
            self.target = (address, port)
        return packet[:8] + bytes(body)

    def pass_answer(self, packet, client):
        if self.deaf:
            return
        if int.from_bytes(packet[2:4], "big") == DISCOVERY_ANSWER:
            packet = packet[:CURRENT_ADDRESS] + socket.inet_aton(self.own) + packet[CURRENT_ADDRESS + 4:]
        self.send(self.control, packet, client)

    def pass_picture(self, packet):
        frame = packet[2:4]
        if frame != self.of:  # a packet that was asked for again comes alone
            if self.packets:
                self.finish()
            self.of = frame
        self.packets.append(packet)
        if packet[4] & 0xF == TRAILER:
            self.finish()

    def finish(self):
        packets, self.packets, self.of = self.packets, [], None
        self.frames += 1
        if self.change is not None:
            packets = self.change(self.frames, packets)
        if self.silent or self.deaf or self.target is None or not self.target[1]:
            return
        for packet in packets:
            self.send(self.stream, packet, self.target)

    @staticmethod
    def send(by, packet, to):
        try:
            by.sendto(packet, to)
        except OSError:  # nobody listens there now
            pass


def with_id(packets, number):
    """The same frame under another id."""
    return [packet[:2] + number.to_bytes(2, "big") + packet[4:] for packet in packets]


def id_of(packets):
    return int.from_bytes(packets[0][2:4], "big")


def later(packets, by_ns):
    """The same frame with another time."""
    result = []
    for packet in packets:
        if packet[4] & 0xF == LEADER:
            time_ns = int.from_bytes(packet[12:20], "big") + by_ns
            packet = packet[:12] + time_ns.to_bytes(8, "big") + packet[20:]
        result.append(packet)
    return result

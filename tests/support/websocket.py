"""A WebSocket client of a few lines, for what a proper client does not do: bad handshakes, malformed frames, not reading."""

import base64
import socket
import struct

from deadline import HUNG_S
from rig import PATIENCE

CONTINUATION, TEXT, BINARY, PING, PONG = 0, 1, 2, 9, 10


def frame(draw, payload, opcode=TEXT):
    """A whole message as a client sends it. `draw` is a random.Random for the mask."""
    length = bytes([0x80 | len(payload)]) if len(payload) < 126 else b"\xfe" + struct.pack(">H", len(payload))
    mask = draw.randbytes(4)
    return bytes([0x80 | opcode]) + length + mask + bytes(a ^ mask[i % 4] for i, a in enumerate(payload))


class RawWebSocket:
    """A connection after the handshake, or after its refusal: then `status` is not 101."""

    def __init__(self, rig, draw, port, path="/", host=None, origin=None, subprotocol=None, receive_buffer=None):
        """`draw` is a random.Random for keys and masks."""
        self.draw = draw
        self.ping = self.answered = None  # payloads of the last ping, and of the last one that was answered
        self.since_ping = 0  # bytes of the messages behind the last ping
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(HUNG_S * PATIENCE)
        self.socket.connect(("127.0.0.1", port))
        rig.callback(self.socket.close)
        lines = [f"GET {path} HTTP/1.1", f"Host: {host or f'127.0.0.1:{port}'}", "Connection: Upgrade", "Upgrade: websocket",
                 "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + base64.b64encode(draw.randbytes(16)).decode()]
        lines += [f"Origin: {origin}"] * (origin is not None)
        lines += [f"Sec-WebSocket-Protocol: {subprotocol}"] * (subprotocol is not None)
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        self.head = b""
        while not self.head.endswith(b"\r\n\r\n"):
            self.head += self.exactly(1)
        self.status = int(self.head.split()[1])

    def exactly(self, count):
        data = bytearray()
        while len(data) < count:
            chunk = self.socket.recv(count - len(data))
            if not chunk:
                raise EOFError
            data += chunk
        return bytes(data)

    def send(self, payload, opcode=TEXT):
        if isinstance(payload, str):
            payload = payload.encode()
        self.socket.sendall(frame(self.draw, payload, opcode))

    def receive(self, answer_pings=True):
        """(opcode, payload) of the next message that is not a control frame."""
        opcode, message = None, b""
        while True:
            first, length = self.exactly(2)
            if length == 126:
                length, = struct.unpack(">H", self.exactly(2))
            elif length == 127:
                length, = struct.unpack(">Q", self.exactly(8))
            payload = self.exactly(length)
            if first & 15 == PING:
                self.ping, self.since_ping = payload, 0
                if answer_pings:
                    self.send(payload, PONG)
                    self.answered = payload
            elif first & 15 in (CONTINUATION, TEXT, BINARY):
                opcode = first & 15 or opcode
                message += payload
                self.since_ping += len(payload)
                if first & 0x80:
                    return opcode, message

"""Peers that speak ZMTP 3.0 by hand, and so can leave unread, and send, what no ZeroMQ library would."""

import socket


def frame(body, more=False, command=False):
    """Encodes one frame."""
    flags = 1 * more | 2 * (len(body) > 255) | 4 * command
    return bytes([flags]) + len(body).to_bytes(8 if flags & 2 else 1, "big") + body


class Peer:
    """A connection whose handshake is done, mechanism NULL. Nothing is read from it after that."""

    def __init__(self, endpoint, kind):
        """`endpoint`: ipc://PATH; `kind`: the type of the peer's socket, "SUB" or "DEALER"."""
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(10)
        self.socket.connect(endpoint.removeprefix("ipc://"))
        self.socket.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32))
        self.read(64)
        metadata = b"\x0bSocket-Type" + len(kind).to_bytes(4, "big") + kind.encode()
        self.socket.sendall(frame(b"\x05READY" + metadata, command=True))
        self.read(self.read(2)[1])

    def read(self, count):
        data = b""
        while len(data) < count:
            got = self.socket.recv(count - len(data))
            if not got:
                raise ConnectionError("the other side has ended the connection")
            data += got
        return data

    def send(self, data):
        """Sends bytes. Returns how many were sent before the other side ended the connection."""
        sent = 0
        try:
            while sent < len(data):
                sent += self.socket.send(data[sent:sent + 65536])
        except (BrokenPipeError, ConnectionResetError):
            pass
        return sent

    def close(self):
        self.socket.close()

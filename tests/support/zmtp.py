"""Peers that speak ZMTP 3.0 by hand, and so can send what no ZeroMQ library would."""

import socket


def frame(body, more=False, command=False):
    """Encodes one frame."""
    flags = 1 * more | 2 * (len(body) > 255) | 4 * command
    return bytes([flags]) + len(body).to_bytes(8 if flags & 2 else 1, "big") + body


def connect(endpoint, seconds=10):
    """Returns a socket that is connected to ipc://PATH or tcp://HOST:PORT, and waits so long at most in each call."""
    if endpoint.startswith("ipc://"):
        one, address = socket.socket(socket.AF_UNIX), endpoint.removeprefix("ipc://")
    else:
        host, port = endpoint.removeprefix("tcp://").rsplit(":", 1)
        one, address = socket.socket(), (host, int(port))
    one.settimeout(seconds)
    try:
        one.connect(address)
    except OSError:
        one.close()
        raise
    return one


class Peer:
    """A connection whose handshake is done, mechanism NULL. Nothing is read from it unless a method says so."""

    MECHANISM = b"NULL"

    def __init__(self, endpoint, kind, seconds=10):
        """`endpoint`: ipc://PATH or tcp://HOST:PORT; `kind`: the type of the peer's socket, "SUB" or "DEALER"; `seconds`: how long
        each step may take.
        """
        self.metadata = b"\x0bSocket-Type" + len(kind).to_bytes(4, "big") + kind.encode()
        self.socket = connect(endpoint, seconds)
        self.socket.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00" + self.MECHANISM.ljust(20, b"\0") + bytes(32))
        self.read(64)
        self.shake_hands()

    def shake_hands(self):
        self.socket.sendall(frame(b"\x05READY" + self.metadata, command=True))
        self.read_command()

    def read_command(self):
        return self.read(self.read(2)[1])

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

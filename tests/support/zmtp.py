"""Peers that speak ZMTP 3.0 by hand, and so can send what no ZeroMQ library would."""

import ctypes
import socket

from zmq.utils import z85


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


class CurvePeer(Peer):
    """The same with encryption, mechanism CURVE (RFC 26)."""

    MECHANISM = b"CURVE"
    SODIUM = ctypes.CDLL("libsodium.so.23")  # which ZeroMQ itself uses

    def __init__(self, endpoint, kind, keys):
        """`keys`: the server's public key, and a pair, in Z85."""
        self.server, self.public, self.secret = (z85.decode(key.encode()) for key in keys)
        self.nonce = 0
        super().__init__(endpoint, kind)

    def next_nonce(self):
        self.nonce += 1
        return self.nonce.to_bytes(8, "big")

    def box(self, text, nonce, public, secret):
        out = ctypes.create_string_buffer(len(text) + 16)
        self.SODIUM.crypto_box_easy(out, text, ctypes.c_ulonglong(len(text)), nonce, public, secret)
        return out.raw

    def open(self, box, nonce, public, secret):
        out = ctypes.create_string_buffer(len(box) - 16)
        if self.SODIUM.crypto_box_open_easy(out, box, ctypes.c_ulonglong(len(box)), nonce, public, secret):
            raise ConnectionError("what the other side sent is not encrypted for this peer")
        return out.raw

    def shake_hands(self):
        public, secret = ctypes.create_string_buffer(32), ctypes.create_string_buffer(32)
        self.SODIUM.crypto_box_keypair(public, secret)
        public, self.passing = public.raw, secret.raw
        nonce = self.next_nonce()
        self.socket.sendall(frame(b"\x05HELLO\x01\x00" + bytes(72) + public + nonce + self.box(
            bytes(64), b"CurveZMQHELLO---" + nonce, self.server, self.passing), command=True))
        welcome = self.read_command()
        text = self.open(welcome[24:], b"WELCOME-" + welcome[8:24], self.server, self.passing)
        self.server_passing, cookie = text[:32], text[32:]
        vouch = bytes(16)
        text = self.public + vouch + self.box(public + self.server, b"VOUCH---" + vouch, self.server_passing,
                                              self.secret) + self.metadata
        nonce = self.next_nonce()
        self.socket.sendall(frame(b"\x08INITIATE" + cookie + nonce + self.box(
            text, b"CurveZMQINITIATE" + nonce, self.server_passing, self.passing), command=True))
        if not self.read_command().startswith(b"\x05READY"):
            raise ConnectionError("this key is not let in")

    def message(self, body, more=False):
        """Encodes one part of a message."""
        nonce = self.next_nonce()
        return frame(b"\x07MESSAGE" + nonce + self.box(bytes([more]) + body, b"CurveZMQMESSAGEC" + nonce, self.server_passing,
                                                       self.passing))

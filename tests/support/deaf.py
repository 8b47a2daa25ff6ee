"""A subscriber that hangs: what it asked for is sent to it, and waits."""

import socket


class Subscriber:
    """Connects and subscribes by ZMTP 3.0, and reads no more."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(10)
        self.socket.connect(path)
        self.socket.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32))
        self.read(64)
        ready = b"\x05READY\x0bSocket-Type" + (3).to_bytes(4, "big") + b"SUB"
        self.socket.sendall(b"\x04" + bytes([len(ready)]) + ready)
        self.read(self.read(2)[1])
        self.socket.sendall(b"\x00\x01\x01")  # to everything

    def read(self, count):
        data = b""
        while len(data) < count:
            data += self.socket.recv(count - len(data))
        return data

    def close(self):
        self.socket.close()

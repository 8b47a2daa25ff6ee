"""A subscriber that hangs: it subscribes to everything and reads nothing."""

import zmtp


class Subscriber(zmtp.Peer):
    def __init__(self, path):
        super().__init__(f"ipc://{path}", "SUB")
        self.socket.sendall(zmtp.frame(b"\x01"))

"""A ZeroMQ socket with its monitor: who is at the other end, why somebody does not let this side in, and peers that
ZeroMQ has given up."""

import asyncio
import contextlib
import itertools
import struct
import time
import weakref
from collections.abc import Iterator

import zmq

from .errors import BadEndpoint, Error, NotAllowed
from .keys import Keys, use_keys

RETRY_S = 0.2  # before an endpoint is tried again that ZeroMQ has given up

_HANDSHAKE = (zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
              | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL | zmq.EVENT_HANDSHAKE_FAILED_AUTH)
_MECHANISM_MISMATCH = 0x11000002  # ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH
_MOST_FAILURES = 5  # some 0.5 s
_MOST_WITHOUT_KEYS = 25  # some 5 s: a tractiond may come to where another listens

_number = itertools.count()


class Handshake:
    """What becomes of a connection, by the events of its monitor."""

    def __init__(self, endpoint: str, has_keys: bool, strangers: int) -> None:
        """So many `strangers` without anybody else in between, who speak of other security than this side, are no chance."""
        self._endpoint, self._has_keys, self._strangers = endpoint, has_keys, strangers
        self._succeeded = False
        self._failures = self._mismatches = 0  # without a word; of security

    def take(self, event: int, value: int) -> Error | None:
        """Why there is no connection, if that is certain."""
        if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self._succeeded, self._failures, self._mismatches = True, 0, 0
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            return NotAllowed(f"the gateway at {self._endpoint} does not let this key do that; on its box, tractionctl "
                              "keys list tells who may do what")
        elif event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL and value == _MECHANISM_MISMATCH:
            # Not seen each time: the other side notices it, too, and who is the first to end the connection tells nothing.
            self._mismatches += 1
            if self._mismatches >= self._strangers:
                self._mismatches = 0
                return NotAllowed(f"who is at {self._endpoint} knows no keys; is it a gateway?" if self._has_keys else
                                  f"the gateway at {self._endpoint} asks for a key, and none is given")
        elif event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL and not self._succeeded:
            # Also when a gateway is restarted or has too many connections: who was let in before, waits.
            self._failures += 1
            if self._failures >= (_MOST_FAILURES if self._has_keys else _MOST_WITHOUT_KEYS):
                self._failures = 0
                return NotAllowed(f"who is at {self._endpoint} ends each connection: " + (
                    "the server key is not this gateway's, or too many are connected; on its box, tractionctl keys list "
                    "tells its key" if self._has_keys else
                    "a gateway asks for a key, and none is given; anything else is no tractiond"))
        return None


def _end(socket: zmq.Socket[bytes], monitor: zmq.Socket[bytes]) -> None:
    if not socket.closed:
        socket.disable_monitor()  # first: where nobody takes its events, ZeroMQ's thread stands still for ever
        socket.close(0)
    monitor.close(0)


class Connection:
    """Belongs to one thread. `socket` and `monitor` are what to wait for."""

    def __init__(self, kind: int, endpoints: list[str], keys: Keys | None, strangers: int,
                 options: dict[int, int | bytes]) -> None:
        """`options` of the socket, set before it connects. Raises BadEndpoint, BadKeys."""
        self._endpoints = endpoints
        self._handshake = Handshake(endpoints[-1], keys is not None, strangers)
        self._connections: set[bytes] = set()  # endpoints that somebody is at
        self._given_up: dict[bytes, float] = {}  # endpoints, and when to try them again
        context = zmq.Context.instance()
        self.socket: zmq.Socket[bytes] = context.socket(kind)
        self.monitor: zmq.Socket[bytes] = context.socket(zmq.PAIR)
        self.close = weakref.finalize(self, _end, self.socket, self.monitor)
        try:
            self.socket.linger = self.monitor.linger = 0
            for option, value in options.items():
                self.socket.setsockopt(option, value)
            use_keys(self.socket, keys)
            address = f"inproc://traction-monitor-{next(_number)}"
            self.socket.monitor(address, _HANDSHAKE | zmq.EVENT_DISCONNECTED | zmq.EVENT_CONNECT_RETRIED)
            self.monitor.rcvhwm = 0  # events that nobody takes would stop ZeroMQ's thread
            self.monitor.connect(address)
            for endpoint in endpoints:
                self._connect(endpoint)
            self._poller = zmq.Poller()
            self._poller.register(self.socket, zmq.POLLIN)
            self._poller.register(self.monitor, zmq.POLLIN)
        except BaseException:
            self.close()
            raise

    def _connect(self, endpoint: str) -> None:
        try:
            self.socket.connect(endpoint)
        except zmq.ZMQError as error:
            raise BadEndpoint(f"cannot connect to '{endpoint}': {error.strerror}; an endpoint is written "
                              "tcp://HOST:PORT or ipc:///PATH") from None

    @property
    def is_connected(self) -> bool:
        return bool(self._connections)

    @property
    def wants_retry(self) -> bool:
        return bool(self._given_up)

    def wait(self, timeout_ms: int) -> None:
        """Until something arrives or happens."""
        self._poller.poll(timeout_ms)

    async def happening(self, timeout_ms: int) -> None:
        """The same for asyncio."""
        sockets = self.socket, self.monitor
        if any(one.poll(0) for one in sockets):  # what a descriptor no longer tells of
            return
        loop = asyncio.get_running_loop()
        something = asyncio.Event()
        timer = loop.call_later(1e-3 * timeout_ms, something.set) if timeout_ms >= 0 else None
        descriptors = [one.FD for one in sockets]
        for one in descriptors:
            loop.add_reader(one, something.set)
        try:
            await something.wait()
        finally:
            for one in descriptors:
                loop.remove_reader(one)
            if timer:
                timer.cancel()

    def events(self) -> Iterator[int]:
        """What has happened since. Raises NotAllowed, once each time."""
        while True:
            try:
                content, address = self.monitor.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            event, value = struct.unpack("=HI", content)
            if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self._connections.add(address)
            elif event == zmq.EVENT_DISCONNECTED:  # also after a handshake that failed: there was no connection
                self._connections.discard(address)
                self._given_up[address] = time.monotonic() + RETRY_S
            elif event == zmq.EVENT_CONNECT_RETRIED:  # ZeroMQ tries it again by itself
                self._given_up.pop(address, None)
            refusal = self._handshake.take(event, value)
            if refusal is not None:
                raise refusal
            yield event

    def look_after(self) -> None:
        """Takes the events, and tries again who did not speak ZeroMQ's protocol, which ZeroMQ never does: a daemon may
        take his place. Raises NotAllowed."""
        for _ in self.events():
            pass
        now = time.monotonic()
        for address in [one for one, when in self._given_up.items() if when <= now]:
            del self._given_up[address]
            for endpoint in self._endpoints:
                if len(self._endpoints) == 1 or endpoint.encode() == address:
                    with contextlib.suppress(zmq.ZMQError):  # ZeroMQ has forgotten it
                        self.socket.disconnect(endpoint)
                    self._connect(endpoint)

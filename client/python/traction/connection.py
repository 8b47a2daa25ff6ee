"""A ZeroMQ socket with its monitor. Reports whether a peer is connected, and why one refuses. Repeats what ZeroMQ does not
repeat: the connection to an endpoint that it has given up, and a subscription that was lost."""

import asyncio
import contextlib
import itertools
import math
import struct
import time
import weakref
from collections.abc import Iterator

import zmq

from .errors import BadEndpoint, Error, NotAllowed
from .keys import Keys, use_keys

_LARGEST_BYTES = 128 << 20  # of a part: a picture of 40 million pixels of 24 bits
_RETRY_S = 0.2  # until an endpoint that ZeroMQ has given up is tried again
_UNHEARD_S = 1.0  # without a message on a new connection until the subscription is sent again

_HANDSHAKE = (zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
              | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL | zmq.EVENT_HANDSHAKE_FAILED_AUTH)
_MECHANISM_MISMATCH = 0x11000002  # ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH
_MOST_FAILURES = 5  # some 0.5 s

_number = itertools.count()


class Handshake:
    """Finds out from the events of a monitor why no connection is made."""

    def __init__(self, endpoint: str, has_keys: bool) -> None:
        self._endpoint, self._has_keys = endpoint, has_keys
        self._succeeded = False
        self._failures = 0  # handshakes that failed without a reason

    def take(self, event: int, value: int) -> Error | None:
        """Processes an event. Returns why there is no connection, if that is certain."""
        if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self._succeeded, self._failures = True, 0
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            return NotAllowed(f"the gateway at {self._endpoint} does not let this key do that; on its box, tractionctl "
                              "keys list tells who may do what")
        elif event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL and value == _MECHANISM_MISMATCH:
            # The peer detects the mismatch, too. If it ends the connection first, this event does not occur.
            return NotAllowed(f"who is at {self._endpoint} knows no keys; is it a gateway?" if self._has_keys else
                              f"the gateway at {self._endpoint} asks for a key, and none is given")
        elif event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL and self._has_keys and not self._succeeded:
            # A gateway that restarts or has too many connections does this, too: a client that was connected waits. Without
            # keys, the mismatch tells what is wrong.
            self._failures += 1
            if self._failures >= _MOST_FAILURES:
                self._failures = 0
                return NotAllowed(f"who is at {self._endpoint} ends each connection: the server key is not this gateway's, or too "
                                  "many are connected; on its box, tractionctl keys list tells its key")
        return None


def _end(socket: zmq.Socket[bytes], monitor: zmq.Socket[bytes]) -> None:
    if not socket.closed:
        socket.disable_monitor()  # first: a monitor whose events are not read blocks ZeroMQ's thread for ever
        socket.close(0)
    monitor.close(0)


class Connection:
    """Is used by one thread. A caller waits for `socket` and `monitor`."""

    def __init__(self, kind: int, endpoints: list[str], keys: Keys | None,
                 options: dict[int, int | bytes], subscription: bytes | None = None) -> None:
        """`options` of the socket are set before it connects. `subscription` is for a socket that subscribes.
        Raises BadEndpoint, BadKeys."""
        self._endpoints, self._subscription = endpoints, subscription
        self._handshake = Handshake(endpoints[-1], keys is not None)
        self._connections: set[bytes] = set()  # endpoints with a peer
        self._unheard_since = math.inf  # time of the newest connection or subscription, if nothing was received since
        self._given_up: dict[bytes, float] = {}  # endpoint -> when to try it again
        context = zmq.Context.instance()
        self.socket: zmq.Socket[bytes] = context.socket(kind)
        self.monitor: zmq.Socket[bytes] = context.socket(zmq.PAIR)
        self.close = weakref.finalize(self, _end, self.socket, self.monitor)
        try:
            self.socket.linger = self.monitor.linger = 0
            self.socket.maxmsgsize = _LARGEST_BYTES
            for option, value in options.items():
                self.socket.setsockopt(option, value)
            use_keys(self.socket, keys)
            address = f"inproc://traction-monitor-{next(_number)}"
            self.socket.monitor(address, _HANDSHAKE | zmq.EVENT_DISCONNECTED | zmq.EVENT_CONNECT_RETRIED)
            self.monitor.rcvhwm = 0  # unread events would otherwise stop ZeroMQ's thread
            self.monitor.connect(address)
            for endpoint in endpoints:
                self._connect(endpoint)
            if subscription is not None:
                self.socket.setsockopt(zmq.SUBSCRIBE, subscription)
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

    def is_connected_beside(self, others: frozenset[bytes]) -> bool:
        """Whether a peer is connected at another endpoint than these."""
        return not self._connections <= others

    @property
    def maintenance_s(self) -> float:
        """Time within which maintain() must be called again [s]; inf: when something happens."""
        return min(_RETRY_S if self._given_up else math.inf,
                   _UNHEARD_S if math.isfinite(self._unheard_since) else math.inf)

    def receive(self) -> list[bytes] | None:
        """Returns the parts of the next message that has arrived already."""
        try:
            parts = self.socket.recv_multipart(zmq.NOBLOCK)
        except zmq.Again:
            return None
        self._unheard_since = math.inf
        return parts

    def wait(self, timeout_ms: int) -> None:
        """Waits for a message or an event."""
        self._poller.poll(timeout_ms)

    async def wait_async(self, timeout_ms: int) -> None:
        """Waits for a message or an event in asyncio's loop."""
        sockets = self.socket, self.monitor
        if any(one.poll(0) for one in sockets):  # a descriptor signals a message only once
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
        """Yields the events since the last call. Raises NotAllowed, once for each refusal."""
        while True:
            try:
                content, address = self.monitor.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            event, value = struct.unpack("=HI", content)
            if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self._connections.add(address)
                self._unheard_since = time.monotonic()
            elif event == zmq.EVENT_DISCONNECTED:  # also after a failed handshake, without a connection
                self._connections.discard(address)
                self._given_up[address] = time.monotonic() + _RETRY_S
            elif event == zmq.EVENT_CONNECT_RETRIED:  # ZeroMQ retries by itself
                self._given_up.pop(address, None)
            refusal = self._handshake.take(event, value)
            if refusal is not None:
                raise refusal
            yield event

    def maintain(self) -> None:
        """Processes the events and repeats what ZeroMQ does not repeat. Raises NotAllowed."""
        for _ in self.events():
            pass
        now = time.monotonic()
        self._connect_again(now)
        self._subscribe_again(now)

    def _connect_again(self, now: float) -> None:
        """Connects to endpoints that were given up: ZeroMQ never reconnects to a peer that did not speak its protocol,
        although a daemon may take that peer's place."""
        for address in [one for one, when in self._given_up.items() if when <= now]:
            del self._given_up[address]
            for endpoint in self._endpoints:
                if len(self._endpoints) == 1 or endpoint.encode() == address:
                    with contextlib.suppress(zmq.ZMQError):  # ZeroMQ has forgotten it
                        self.socket.disconnect(endpoint)
                    self._connect(endpoint)

    def _subscribe_again(self, now: float) -> None:
        """Sends the subscription again if nothing was received since a connection was made: a publisher that conflates,
        as *latest* does, also conflates what it receives, and its ZeroMQ may drop the subscription."""
        if self._subscription is None or not self._connections or now - self._unheard_since < _UNHEARD_S:
            return
        self.socket.setsockopt(zmq.SUBSCRIBE, self._subscription)
        self._unheard_since = now

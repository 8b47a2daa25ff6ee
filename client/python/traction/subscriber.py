"""Receives what an instance of tractiond publishes, and the contacts that traction-touch makes of it."""

import math
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import zmq

from .connection import Connection
from .decode import Message
from .endpoints import DEFAULT_INSTANCE, TOUCH, locate
from .errors import NoAnswer
from .intake import Intake, Mode, Topics
from .keys import Keys
from .messages import Field

# Protobuf key of Field.timestamp, which is the first field of a message and never 0. Latest subscribes to it, and
# receives nothing of a stream.
_FIELD_BEGINS = b"\x09"

_LATEST_QUEUE = 1000  # messages that wait in Mode.LATEST, of which all but the newest are passed over
_QUIET_MS = 5  # silence after which nothing waits in the network: what waits there comes as fast as it is read
_CATCH_UP_S = 0.05  # until that silence at most: a publisher may never be silent for so long
_MOST_PASSED = 100 * _LATEST_QUEUE  # a publisher may be faster than it is read


class Base:
    """The common part of Subscriber and aio.Subscriber."""

    def __init__(self, instance: str = DEFAULT_INSTANCE, *, endpoint: str = "", keys: Keys | None = None,
                 mode: Mode = Mode.STREAM, topics: Topics = Topics.ALL, queue: int = 1000,
                 timeout: float | None = None) -> None:
        """Connects to `endpoint`, such as "tcp://HOST:9872", or to the `instance` on this machine, without waiting for
        the daemon. `keys` are needed for a gateway. `topics` selects messages of the stream. `queue` is the number of
        messages kept for a slow reader of the stream; more are lost. `timeout` [s] limits an iteration's wait; None: no limit.
        Raises BadEndpoint, BadKeys."""
        self._latest = latest = mode is Mode.LATEST
        endpoints, touch = [endpoint] if endpoint else [], []
        if not endpoint and (latest or topics & ~Topics.OF_TOUCH):
            endpoints = [one.latest if latest else one.stream for one in locate(instance)]
        if not endpoint and not latest and topics & Topics.OF_TOUCH:
            touch = [one.stream for one in locate(instance, TOUCH)]
        self.endpoint = (endpoints or touch)[-1]  # named in messages
        options: dict[int, int | bytes] = {
            # Keep-alive detects a daemon's host that disappears silently, and the socket reconnects. ZeroMQ's own
            # heartbeats are not used: in 4.3.4 a heartbeat that falls due after the connection's end aborts the process
            # if the queue is full.
            zmq.RCVHWM: _LATEST_QUEUE if latest else queue, zmq.TCP_KEEPALIVE: 1, zmq.TCP_KEEPALIVE_IDLE: 10, zmq.TCP_KEEPALIVE_INTVL: 5,
            zmq.TCP_KEEPALIVE_CNT: 3}
        # The stream subscribes to everything, so that a daemon of another version or a wrong endpoint is detected
        # instead of waited for.
        subscription = _FIELD_BEGINS if latest else b""
        self._touch = frozenset(one.encode() for one in touch) if endpoints else frozenset()
        self._subscription = subscription
        self._connection = Connection(zmq.SUB, endpoints + touch, keys, options, subscription)
        self._intake = Intake(self.endpoint, mode, topics)
        self._timeout = timeout

    @property
    def lost(self) -> int:
        """Number of messages lost since this subscriber connected, by gaps in their sequence. A restart of the daemon
        is no loss, nor are the messages that Mode.LATEST skips."""
        return self._intake.lost

    @property
    def restarts(self) -> int:
        """Number of restarts of the daemon, by the `boot` of its messages."""
        return self._intake.restarts

    @property
    def second_source(self) -> str:
        """A sentence that names two daemons that have one sensor.name, or two traction-touch, if there were such: the one heard
        first is received, and the other, but for its first message, is left out while that sends. Else empty."""
        return self._intake.sources.trouble

    @property
    def is_connected(self) -> bool:
        """Whether a publisher is connected, even if nothing was received yet; where contacts are received besides others,
        tractiond. Raises NotAllowed."""
        self._connection.maintain()
        return self._connection.is_connected_beside(self._touch)

    def close(self) -> None:
        """Ends the connection; so does the end of the object."""
        self._connection.close()

    def _now(self) -> Message | None:
        """Returns the next wanted message that has arrived already. Raises Malformed, OtherVersion, BadEndpoint."""
        receive = self._newest if self._latest else self._connection.receive
        while (parts := receive()) is not None:
            more = self._intake.wanted_too(parts)
            if more is not None:
                self._connection.socket.setsockopt(zmq.SUBSCRIBE, more)
            returns = self._intake.sources.returns
            message = self._intake.take(parts)
            if self._intake.sources.returns != returns:  # the other's description came
                self._connection.socket.setsockopt(zmq.SUBSCRIBE, self._subscription)
            if message is not None:
                return message
        return self._intake.end_silent()

    def _newest(self) -> list[bytes] | None:
        """Returns the newest message that has arrived. ZMQ_CONFLATE would do the same, but ZeroMQ 4.3.4 aborts the process
        if a message in parts reaches such a socket. Behind a queue that was full, newer ones wait in the network: they
        are read until none comes for _QUIET_MS. A queue may be full at half of its size, as ZeroMQ counts what was read
        in steps of that."""
        newest = self._connection.receive()
        if newest is None:
            return None
        passed, end = 0, time.monotonic() + _CATCH_UP_S
        while True:
            # poll() is cheaper than a receive() that finds nothing, as after each message of a reader that keeps up.
            while passed < _MOST_PASSED and self._connection.socket.poll(0):
                newest, passed = self._connection.receive() or newest, passed + 1
            if 2 * passed < _LATEST_QUEUE or passed >= _MOST_PASSED or time.monotonic() > end:
                return newest
            if not self._connection.socket.poll(_QUIET_MS):
                return newest

    def _wait_ms(self, end: float) -> int:
        """Returns the time to wait for an event, at most until `end` of time.monotonic() [s]. -1: no limit."""
        left = max(0.0, min(end - time.monotonic(), self._connection.maintenance_s, self._intake.until_silence_s()))
        return -1 if math.isinf(left) else math.ceil(1e3 * left)

    def _silence(self) -> NoAnswer:
        return NoAnswer(f"nothing came from {self.endpoint} within {self._timeout:g} s")


def end_of(timeout: float | None) -> float:
    return math.inf if timeout is None else time.monotonic() + timeout


class Subscriber(Base):
    """Is used by one thread at a time. The daemon may start later or restart: receive() continues.

    Of contacts, each that begins ends once, whatever happens to traction-touch and to messages: one that was there
    before begins when it is first seen; one that is missing in a message, or is of another run, ends in it; and all end
    in a message of the library's own after a second without a message of traction-touch.
    """

    def receive(self, timeout: float | None = None) -> Message | None:
        """Returns the next message, or None after `timeout` seconds (None: no limit). A new subscriber is sent the
        description at once. Raises OtherVersion, Malformed, NotAllowed, BadEndpoint; the next call continues."""
        end = end_of(timeout)
        while (message := self._now()) is None:
            self._connection.maintain()
            if time.monotonic() >= end:
                return None
            self._connection.wait(self._wait_ms(end))
        return message

    def __iter__(self) -> Iterator[Message]:
        """Yields messages without end. Raises as receive() does, and NoAnswer if none arrives within the timeout."""
        while (message := self.receive(self._timeout)) is not None:
            yield message
        raise self._silence()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def fields(instance: str = DEFAULT_INSTANCE, *, endpoint: str = "", keys: Keys | None = None,
           mode: Mode = Mode.STREAM, timeout: float | None = 5.0) -> Iterator[Field]:
    """Yields the fields of an instance without end. Raises as Subscriber does, and NoAnswer if none arrives within
    `timeout` [s]."""
    with Subscriber(instance, endpoint=endpoint, keys=keys, mode=mode, topics=Topics.FIELD, timeout=timeout) as one:
        for message in one:
            assert isinstance(message, Field)
            yield message

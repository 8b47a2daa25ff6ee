"""Receives what an instance of tractiond publishes."""

import math
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import zmq

from .connection import RETRY_S, Connection
from .decode import Message
from .endpoints import DEFAULT_INSTANCE, locate
from .errors import NoAnswer
from .intake import Intake, Mode, Topics
from .keys import Keys
from .messages import Field

# The key of Field.timestamp, its first field, which is never 0. Latest is subscribed to that: ZeroMQ 4.3.4 aborts the
# process where a message in parts, as a stream's are, reaches a socket that conflates.
_FIELD_BEGINS = b"\x09"

_STRANGERS = 3  # who speak of keys where none are given, before they are taken for the one who is meant


class Base:
    """What Subscriber and aio.Subscriber have in common."""

    def __init__(self, instance: str = DEFAULT_INSTANCE, *, endpoint: str = "", keys: Keys | None = None,
                 mode: Mode = Mode.STREAM, topics: Topics = Topics.ALL, queue: int = 1000,
                 timeout: float | None = None) -> None:
        """`endpoint`, ZeroMQ's, "tcp://HOST:9872", else where the `instance` is on this machine; `keys` for a gateway;
        `topics` of the stream; `queue`: messages that wait here for a slow reader before some are lost; `timeout` [s]
        of an iteration, None: for ever. Does not wait for the daemon. Raises BadEndpoint, BadKeys."""
        latest = mode is Mode.LATEST
        endpoints = [endpoint] if endpoint else [one.latest if latest else one.stream for one in locate(instance)]
        options: dict[int, int | bytes] = {
            # A daemon's host that disappears without a word is noticed, and connected to again. Not by ZeroMQ's
            # heartbeats: one that falls due after the connection's end makes 4.3.4 abort where the queue is full.
            zmq.RCVHWM: queue, zmq.TCP_KEEPALIVE: 1, zmq.TCP_KEEPALIVE_IDLE: 10, zmq.TCP_KEEPALIVE_INTVL: 5,
            zmq.TCP_KEEPALIVE_CNT: 3, zmq.CONFLATE: int(latest),
            # The stream to everything: a daemon of another version, or the wrong endpoint, is noticed instead of
            # waited for.
            zmq.SUBSCRIBE: _FIELD_BEGINS if latest else b""}
        self._connection = Connection(zmq.SUB, endpoints, keys, _STRANGERS, options)
        self._intake = Intake(endpoints[-1], mode, topics)
        self._timeout = timeout
        self.endpoint = endpoints[-1]  # where it connects to; for messages to people

    @property
    def lost(self) -> int:
        """Messages that were sent since this subscriber joined and did not arrive, by gaps in their sequence. A restart
        of the daemon is no loss; neither is what Mode.LATEST passes over."""
        return self._intake.lost

    @property
    def restarts(self) -> int:
        """How often the daemon was started anew, by the `boot` of its messages."""
        return self._intake.restarts

    @property
    def is_connected(self) -> bool:
        """Somebody publishes at the endpoint, whether or not there is anything to say yet. Raises NotAllowed."""
        self._connection.look_after()
        return self._connection.is_connected

    def close(self) -> None:
        """Who is dropped is closed, too."""
        self._connection.close()

    def _now(self) -> Message | None:
        """The next wanted message that is here already. Raises Malformed, OtherVersion, BadEndpoint."""
        while True:
            try:
                parts = self._connection.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return None
            more = self._intake.wanted_too(parts)
            if more is not None:
                self._connection.socket.setsockopt(zmq.SUBSCRIBE, more)
            message = self._intake.take(parts)
            if message is not None:
                return message

    def _wait_ms(self, end: float) -> int:
        """How long to wait for what may happen: no longer than until `end`, of time.monotonic() [s]. -1: for ever."""
        left = max(0.0, end - time.monotonic())
        if self._connection.wants_retry:
            left = min(left, RETRY_S)
        return -1 if math.isinf(left) else math.ceil(1e3 * left)

    def _silence(self) -> NoAnswer:
        return NoAnswer(f"nothing came from {self.endpoint} within {self._timeout:g} s")


def end_of(timeout: float | None) -> float:
    return math.inf if timeout is None else time.monotonic() + timeout


class Subscriber(Base):
    """Belongs to one thread at a time. The daemon may start later, and again: receive() goes on."""

    def receive(self, timeout: float | None = None) -> Message | None:
        """The next message; None: none came within `timeout` seconds (None: for ever). A new subscriber is sent the
        description at once. Raises OtherVersion, Malformed, NotAllowed, BadEndpoint; the next call goes on."""
        end = end_of(timeout)
        while (message := self._now()) is None:
            self._connection.look_after()
            if time.monotonic() >= end:
                return None
            self._connection.wait(self._wait_ms(end))
        return message

    def __iter__(self) -> Iterator[Message]:
        """Messages for ever. Raises, besides what receive() does, NoAnswer where none comes within the timeout."""
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
    """The fields of an instance, for ever. Raises as Subscriber does; NoAnswer where none comes within `timeout` [s]."""
    with Subscriber(instance, endpoint=endpoint, keys=keys, mode=mode, topics=Topics.FIELD, timeout=timeout) as one:
        for message in one:
            assert isinstance(message, Field)
            yield message

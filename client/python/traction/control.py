"""Asks things of a running tractiond."""

import os
import stat
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self, cast

import zmq

from .connection import Connection
from .decode import reader
from .description import Description, Zero
from .endpoints import DEFAULT_INSTANCE, locate
from .errors import Error, Malformed, NoAnswer, OtherVersion, Refused
from .keys import Keys
from .status import Status
from .wire import message, parse

_VERSION = 1
_LONGEST_ZERO_S = 1e6  # a longer one in a reply is not believed
_ON_THE_WAY_S = 2.0


@dataclass(slots=True, eq=False)
class ZeroResult:
    """What came of zero() or undo_zero()."""

    zero: Zero  # the zero taken or restored
    markers_present: int  # found in the picture
    markers_expected: int  # of the gel
    noise_levels: float  # standard deviation of a pixel between the rest frames [levels of the format]
    remark: str  # why it may be wrong; empty: no reason is known


class Control:
    """Thread-safe: every request has a connection of its own. Each of them raises NoAnswer, OtherVersion, Malformed,
    Refused, BadKeys, NotAllowed."""

    def __init__(self, instance: str = DEFAULT_INSTANCE, *, endpoint: str = "", keys: Keys | None = None,
                 timeout: float = 3.0, zero_timeout: float = 15.0) -> None:
        """`endpoint`, ZeroMQ's, "tcp://HOST:9884", else where the `instance` is on this machine; `timeout` [s] for an
        answer, `zero_timeout` [s] for a zero at least: longer where the daemon's status says so. Raises BadEndpoint."""
        self._instance, self._endpoint = instance, endpoint
        self.endpoint  # raises what a request would
        self._keys, self._timeout, self._zero_timeout = keys, timeout, zero_timeout

    @property
    def endpoint(self) -> str:
        """To which a request goes now: of an instance, whose daemon may start later, it is looked up anew."""
        return self._endpoint or locate(self._instance)[-1].control

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Does nothing: no connection outlives its request."""

    def status(self) -> Status:
        """The last one published."""
        return cast(Status, self._ask("status", Status, self._timeout))

    def describe(self) -> Description:
        """The description as it stands."""
        return cast(Description, self._ask("description", Description, self._timeout))

    def zero(self, *, anyway: bool = False) -> ZeroResult:
        """Takes what the camera sees now as the unloaded gel, and waits for it; `anyway`: also if something seems to
        touch."""
        return cast(ZeroResult, self._ask("zero", ZeroResult, max(self._zero_timeout, self._zero_takes()), anyway=anyway))

    def undo_zero(self) -> ZeroResult:
        """Restores the previous zero; the one in force becomes the previous one."""
        return cast(ZeroResult, self._ask("zero", ZeroResult, max(self._zero_timeout, self._zero_takes()), undo=True))

    def _zero_takes(self) -> float:
        """A daemon may average over thousands of frames, and its disk may be slow: it says how long a zero takes at most [s]."""
        try:
            within_s: float = self.status().zero_within_s
            return min(max(within_s, 0.0), _LONGEST_ZERO_S) + _ON_THE_WAY_S
        except Error:  # of the zero itself the caller shall hear
            return 0.0

    def _ask(self, what: str, kind: type, timeout: float, **arguments: bool) -> Any:
        request = message("Request")(version=_VERSION)
        part = getattr(request, what)
        part.SetInParent()
        for name, value in arguments.items():
            setattr(part, name, value)
        reply = parse("Reply", self._exchange(request.SerializeToString(), timeout))
        if reply.version != _VERSION:
            raise OtherVersion(f"the daemon speaks version {reply.version} of the protocol, this library {_VERSION}")
        if reply.error:
            raise Refused(reply.error)
        if reply.WhichOneof("reply") != what:
            raise Malformed("the reply does not answer the request")
        return reader(kind)(getattr(reply, what))

    def _exchange(self, request: bytes, timeout: float) -> bytes:
        self._expect_socket()
        connection = Connection(zmq.REQ, [self.endpoint], self._keys, {})
        try:
            self._expect_peer(connection)
            connection.socket.send(request)
            if not connection.socket.poll(int(1e3 * timeout)):
                raise NoAnswer(f"somebody is at {self.endpoint}, but has not answered within {timeout:.0f} s; a tractiond "
                               "that computes the factors of a new gel answers later")
            return connection.socket.recv()
        finally:
            connection.close()

    def _expect_socket(self) -> None:
        """A socket file that is not there would be waited for."""
        if not self.endpoint.startswith("ipc://") or self.endpoint.startswith("ipc://@"):
            return
        path = self.endpoint.removeprefix("ipc://")
        try:
            is_there, is_open = stat.S_ISSOCK(os.stat(path).st_mode), os.access(path, os.W_OK)
        except OSError as error:
            is_there, is_open = isinstance(error, PermissionError), False
        if not is_there:
            raise NoAnswer(f"nothing answers at {self.endpoint}; is tractiond running?")
        if not is_open:
            raise NoAnswer(f"you may not ask at {self.endpoint}: only the user that tractiond runs as and its group may "
                           "(usermod --append --groups tractiond USER)")

    def _expect_peer(self, connection: Connection) -> None:
        end = time.monotonic() + self._timeout
        is_somebody = False
        while (left := end - time.monotonic()) > 0:
            connection.monitor.poll(max(1, int(1e3 * left)))
            for event in connection.events():
                if event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                    return
                is_somebody = is_somebody or event == zmq.EVENT_DISCONNECTED  # without a handshake
        raise NoAnswer(f"who is at {self.endpoint} takes no requests; is it the endpoint 'control' of a tractiond? A "
                       "gateway asks for a key" if is_somebody else
                       f"nothing answers at {self.endpoint}; is tractiond running?")

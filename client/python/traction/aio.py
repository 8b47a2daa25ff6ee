"""The client for asyncio: `async for field in traction.aio.fields()`."""

import asyncio
import time
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Self

from . import control
from .decode import Message
from .description import Description
from .endpoints import DEFAULT_INSTANCE
from .intake import Mode, Topics
from .keys import Keys
from .messages import Field
from .status import Status
from .subscriber import Base, end_of

__all__ = ["Control", "Subscriber", "fields"]


class Subscriber(Base):
    """Is used by one task at a time; otherwise like traction.Subscriber."""

    async def receive(self, timeout: float | None = None) -> Message | None:
        """Returns the next message, or None after `timeout` seconds (None: no limit). Cancellation loses no message."""
        end = end_of(timeout)
        while (message := self._now()) is None:
            self._connection.maintain()
            if time.monotonic() >= end:
                return None
            await self._connection.wait_async(self._wait_ms(end))
        return message

    async def __aiter__(self) -> AsyncIterator[Message]:
        while (message := await self.receive(self._timeout)) is not None:
            yield message
        raise self._silence()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        trace: TracebackType | None) -> None:
        self.close()


async def fields(instance: str = DEFAULT_INSTANCE, *, endpoint: str = "", keys: Keys | None = None,
                 mode: Mode = Mode.STREAM, timeout: float | None = 5.0) -> AsyncIterator[Field]:
    """Like traction.fields()."""
    async with Subscriber(instance, endpoint=endpoint, keys=keys, mode=mode, topics=Topics.FIELD, timeout=timeout) as one:
        async for message in one:
            assert isinstance(message, Field)
            yield message


class Control:
    """Like traction.Control; each request waits in a thread of asyncio's pool."""

    def __init__(self, control: control.Control) -> None:
        self._control = control

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        trace: TracebackType | None) -> None:
        """Does nothing: no connection outlives its request."""

    async def status(self) -> Status:
        return await asyncio.to_thread(self._control.status)

    async def describe(self) -> Description:
        return await asyncio.to_thread(self._control.describe)

    async def zero(self, *, anyway: bool = False) -> control.ZeroResult:
        return await asyncio.to_thread(self._control.zero, anyway=anyway)

    async def undo_zero(self) -> control.ZeroResult:
        return await asyncio.to_thread(self._control.undo_zero)

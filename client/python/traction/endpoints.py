"""Where an instance of tractiond is met from here: as proto/traction/v1/endpoints.h has it."""

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

from .errors import BadEndpoint

DEFAULT_INSTANCE = "default"


@dataclass(frozen=True)
class Endpoints:
    """ZeroMQ's."""

    stream: str  # every message
    latest: str  # the newest field alone
    control: str  # requests and replies


# Of the default instance alone. Control is not on TCP: only the socket file's group may ask.
TCP = Endpoints("tcp://127.0.0.1:9872", "tcp://127.0.0.1:9873", f"ipc:///run/tractiond/{DEFAULT_INSTANCE}/control")


def _runtime_directories(instance: str) -> list[Path]:
    """The user's own (without a login session in /tmp), the system's."""
    of_user = os.environ.get("XDG_RUNTIME_DIR", "")
    own = Path(of_user, "tractiond") if of_user.startswith("/") else Path(f"/tmp/tractiond-{os.getuid()}")
    return [own / instance, Path("/run/tractiond", instance)]


def _is_open(path: Path) -> bool:
    """A service's sockets are for its group only."""
    try:
        return stat.S_ISSOCK(path.stat().st_mode) and os.access(path, os.W_OK)
    except OSError:
        return False


def locate(instance: str = DEFAULT_INSTANCE) -> list[Endpoints]:
    """Of the runtime directory in which the instance's sockets are. Where there is none: TCP for the default instance,
    else the directories in which it may start. Never empty. Raises BadEndpoint for an impossible name."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,24}", instance):
        raise BadEndpoint(f"'{instance}' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -")
    possible = []
    for directory in _runtime_directories(instance):
        found = Endpoints(*(f"ipc://{directory / name}" for name in ("stream", "latest", "control")))
        if _is_open(directory / "stream"):
            return [found]
        possible.append(found)
    return [TCP] if instance == DEFAULT_INSTANCE else possible

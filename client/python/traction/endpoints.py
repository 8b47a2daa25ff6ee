"""Where an instance of tractiond, or of traction-touch, is reached from here: as proto/traction/v1/endpoints.h has it."""

import contextlib
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


DAEMON, TOUCH = "tractiond", "traction-touch"  # the programs that publish
# Of the default instance alone; traction-touch has a stream only.
_TCP = {DAEMON: TCP, TOUCH: Endpoints("tcp://127.0.0.1:9876", "", "")}


def _runtime_directories(instance: str, program: str) -> list[Path]:
    """The user's own (without a login session in /tmp), the system's."""
    of_user = os.environ.get("XDG_RUNTIME_DIR", "")
    own = Path(of_user, program) if of_user.startswith("/") else Path(f"/tmp/{program}-{os.getuid()}")
    return [own / instance, Path("/run", program, instance)]


def _is_open(path: Path) -> bool:
    """A service's sockets are for its group only."""
    try:
        return stat.S_ISSOCK(path.stat().st_mode) and os.access(path, os.W_OK)
    except OSError:
        return False


def _can_others_write(of: os.stat_result) -> bool:
    """A symbolic link itself cannot be written."""
    return not stat.S_ISLNK(of.st_mode) and bool(of.st_mode & stat.S_IWOTH)


def _can_others_control(directory: Path) -> bool:
    """As canOthersControl() in base/directory.h."""

    def is_trusted(of: os.stat_result) -> bool:
        return of.st_uid in (0, os.geteuid()) and not _can_others_write(of)

    try:
        own = directory if directory.exists() else directory.parent
        if not own.exists():
            return False
        folder = own.absolute().parent
        return (
            _can_others_write(own.stat())
            or (_can_others_write(folder.stat()) and not (is_trusted(own.stat()) and is_trusted(own.lstat())))
            or (_can_others_write(folder.parent.stat()) and not is_trusted(folder.lstat()))
        )
    except OSError:
        return True


def _check_control(directory: Path) -> None:
    if _can_others_control(directory):
        raise BadEndpoint(
            f"the runtime directory {directory} cannot be used: another user may control it, as every user can write "
            "into it or a directory above; set XDG_RUNTIME_DIR to a directory of your own"
        )


def locate(instance: str = DEFAULT_INSTANCE, program: str = DAEMON) -> list[Endpoints]:
    """Of the runtime directory in which the instance's sockets are. Where there is none: TCP for the default instance,
    else the directories in which it may start, of which /tmp/tractiond-UID is made so that it is no other user's. Never
    empty. Raises BadEndpoint for an impossible name, or if another user may control the directory."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,24}", instance):
        raise BadEndpoint(f"'{instance}' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -")
    possible = []
    for directory in _runtime_directories(instance, program):
        found = Endpoints(*(f"ipc://{directory / name}" for name in ("stream", "latest", "control")))
        if _is_open(directory / "stream"):
            _check_control(directory)
            return [found]
        possible.append(found)
    if instance == DEFAULT_INSTANCE:
        return [_TCP[program]]
    own = _runtime_directories(instance, program)[0]
    with contextlib.suppress(OSError):
        if _can_others_write(own.parent.parent.stat()):
            own.parent.mkdir(0o700)  # otherwise another user could make it later
    _check_control(own)
    return possible

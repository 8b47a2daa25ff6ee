"""How the daemon does: published once a second, with or without frames."""

import enum
from dataclasses import dataclass

from .description import Colour
from .messages import Header
from .shapes import Doubles


class CameraState(enum.Enum):
    UNKNOWN = 0  # not opened yet
    WAITING = 1  # not there yet; being looked for
    STREAMING = 2  # open
    LOST = 3  # was there and is gone; being looked for
    CONNECTING = 4  # found; being set up


@dataclass(slots=True, eq=False)
class CameraLink:
    """Of the link to the camera; packets since the daemon was started, but those of the last second before a link broke."""

    packets_resent: int  # asked for again, and come
    packets_missing: int  # never come
    ptp: str  # the camera's word for its PTP state; empty: it has none
    ptp_offset_s: float | None  # of the camera's clock from its master's, as the camera says
    temperature: float | None  # of the camera [degrees Celsius]
    packets_refused: int  # kept from stream and control channel: not the camera's, or no room for them


@dataclass(slots=True, eq=False)
class Ledger:
    """The account of every frame since the start of the daemon: received = published + in_flight + losses."""

    received: int  # handed over by the camera driver, good or bad
    published: int
    in_flight: int

    incomplete: int  # packets missing, aborted ...
    wrong_size: int  # payload or picture size is not what was agreed
    wrong_format: int  # pixel format is not what was agreed
    stale: int  # an old picture handed out again
    implausible: int  # id or time jumped ahead; held back until three frames in a row agree
    evicted_before_track: int  # newer frames came before tracking had time for this one
    no_rest_pose: int  # used to find the markers and to take the zero
    evicted_before_solve: int
    evicted_before_publish: int
    discarded_at_stop: int
    no_gel: int  # could be looked at, and nothing was measured: the daemon has no gel file

    missing: int  # never arrived, by gaps in the camera's ids; not part of the sum
    reconnects: int  # how often the camera was lost and opened again
    doubted: int  # new frames that may not be the camera's own
    invalid: int  # of the published: fields that are not valid

    @property
    def losses(self) -> int:
        return (self.incomplete + self.wrong_size + self.wrong_format + self.stale + self.implausible
                + self.evicted_before_track + self.no_rest_pose + self.no_gel
                + self.evicted_before_solve + self.evicted_before_publish + self.discarded_at_stop)


@dataclass(slots=True, eq=False)
class Rates:
    """Over the time since the status before."""

    received_hz: float
    published_hz: float


@dataclass(slots=True, eq=False)
class Histogram:
    """All durations since the start of the daemon."""

    bound_s: Doubles
    count: tuple[int, ...]  # each above the bound before and at most its own; one more: above the last
    sum_s: float


@dataclass(slots=True, eq=False)
class Quantiles:
    p50_s: float
    p99_s: float
    max_s: float
    since_start: Histogram


@dataclass(slots=True, eq=False)
class Latencies:
    """Of the fields since the status before; 0 where there was none."""

    track: Quantiles  # frame popped from the driver -> markers found
    solve: Quantiles  # -> forces known
    send: Quantiles  # -> handed to be sent
    total: Quantiles  # frame popped from the driver -> handed to be sent


@dataclass(slots=True, eq=False)
class RestDrift:
    """How far the untouched picture has come from the zero; scale and roll about the principal point."""

    shift_u_px: float  # right
    shift_v_px: float  # down
    scale: float  # relative
    roll_rad: float  # u towards v
    rms_px: float  # of the markers' coordinates besides that
    age_s: float  # since the last frame in which nothing touched


@dataclass(slots=True, eq=False)
class LayerStatus:
    colour: Colour
    expected: int  # markers of the gel file
    found: int  # in the newest frame
    in_zero: int  # in the zero in force; 0: there is none
    columns: int  # that the picture showed when the markers were labelled last; 0: never
    rows: int


@dataclass(slots=True, eq=False)
class GelFinding:
    """A number of the gel file, and what the rest picture shows instead."""

    name: str  # with its unit: "pitch_mm"
    expected: float
    seen: float
    deviation: float  # standard, of their difference; 0: a number that is counted
    contradicts: bool  # fields carry Flag.GEL_MISMATCH


@dataclass(slots=True, eq=False)
class MarkerStatus:
    """How many markers are found, and whether they are those of the gel file."""

    layers: tuple[LayerStatus, ...]  # none, with a remark: there is no gel
    remark: str  # for people: why markers are missing, what contradicts the gel file; empty: all is well
    findings: tuple[GelFinding, ...]


@dataclass(slots=True, eq=False)
class Turns:
    """Of each stage's loop since the start: one that stands still hangs."""

    capture: int
    track: int
    solve: int
    publish: int
    control: int


@dataclass(slots=True, eq=False)
class ThreadScheduling:
    name: str  # as in /proc/PID/task/TID/comm
    priority: int  # among real-time threads, 1 to 99; 0: it is none
    cpus: str  # that it may run on, "0-2,5"


@dataclass(slots=True, eq=False)
class Scheduling:
    """How the kernel runs the threads that a frame passes, and what it keeps in memory: asked, and as it is."""

    asked_priority: int  # 0: none
    asked_cpus: str  # empty: any
    asked_lock: bool
    threads: tuple[ThreadScheduling, ...]
    locked_bytes: int  # of the address space, that stay in memory once touched


@dataclass(slots=True, eq=False)
class Status:
    header: Header
    uptime_s: float
    camera: CameraState
    ledger: Ledger
    rates: Rates
    latencies: Latencies
    turns: Turns
    rest_drift: RestDrift | None  # none: nothing has been seen untouched since the zero or the start
    markers: MarkerStatus
    camera_why: str  # why it does not stream; empty: it does, or nobody knows
    camera_link: CameraLink | None  # none: not opened yet
    zero_within_s: float  # a zero that is asked for now is answered within this time; 0: not known
    log_lines_lost: int  # of the daemon's log, whose reader was too slow or whose disk was full
    memory_bytes: int  # that the daemon holds; 0: not known
    invalid_why: str  # why fields since the status before are not valid, with the key that decides; empty: none is
    unreleased_why: str  # why the camera would stay locked after a kill -9 of the daemon; empty: it would not
    residual_px: float  # Field.residual_px since the status before, root mean square
    scheduling: Scheduling

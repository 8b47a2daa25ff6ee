"""Holds a force: a controller on *latest* that moves an axis along z until the gel feels what is wanted.

Dead man's rule. The axis stops, and stays so until a person starts this anew, when
  stale     no field came for 50 ms, or the newest is older than that
  flagged   a field is not valid, or carries any flag but ZERO_UNVERIFIED and GEL_UNVERIFIED
  lost      more than 3 frames passed between two fields, or the daemon, its sensor or its zero is another one
and when anything raises. It runs on the daemon's host: only there do both read the same clock.

usage: hold_force.py NEWTONS [INSTANCE]      prints what it would do; give it your axis in the place of Axis
"""

import sys
import time

import traction

LONGEST_S = 0.050
MOST_FRAMES = 3
GAIN_M_PER_NS = 1e-3  # speed for each newton that is missing [m/(N s)]
FASTEST_M_PER_S = 2e-3


class Axis:
    """Yours goes here. Towards the gel is positive."""

    def move(self, speed_m_per_s: float) -> None:
        print(f"move {1e3 * speed_m_per_s:+.3f} mm/s", flush=True)

    def stop(self) -> None:
        print("stop", flush=True)


class Hold:
    def __init__(self, newtons: float) -> None:
        self.newtons = newtons
        self.last: traction.Header | None = None

    def doubt(self, field: traction.Message | None, now_ns: int) -> str:
        """Why not to move on this; empty: nothing. `now_ns`: CLOCK_MONOTONIC."""
        if not isinstance(field, traction.Field):
            return f"stale: no field for {1e3 * LONGEST_S:.0f} ms"
        header, last = field.header, self.last
        self.last = header
        if now_ns - header.received_ns > 1e9 * LONGEST_S:
            return f"stale: the newest field is {1e-6 * (now_ns - header.received_ns):.0f} ms old"
        doubts = header.flags & ~(traction.Flag.ZERO_UNVERIFIED | traction.Flag.GEL_UNVERIFIED).value  # those of a later daemon, too
        if doubts or not field.valid:
            return f"flagged: {doubts.name or int(doubts) or 'not valid'}"
        if last is None:
            return ""
        if (header.boot, header.sensor, header.zero) != (last.boot, last.sensor, last.zero):
            return "lost: another daemon, sensor or zero"
        passed = header.frame_number - last.frame_number
        return f"lost: {passed} frames from one field to the next" if passed > MOST_FRAMES else ""

    def speed_m_per_s(self, field: traction.Field) -> float:
        wanted = GAIN_M_PER_NS * (self.newtons - float(field.resultant_N[2]))
        return max(-FASTEST_M_PER_S, min(FASTEST_M_PER_S, wanted))


def main() -> str:
    hold, axis = Hold(float(sys.argv[1])), Axis()
    instance = sys.argv[2] if len(sys.argv) > 2 else "default"
    if not traction.Control(instance).describe().same_host:
        return "this is not the daemon's host"
    try:
        with traction.Subscriber(instance, mode=traction.Mode.LATEST) as subscriber:
            field = subscriber.receive(5.0)  # of the first it is not known yet when it comes
            while not (why := hold.doubt(field, time.monotonic_ns())):
                assert isinstance(field, traction.Field)
                axis.move(hold.speed_m_per_s(field))
                field = subscriber.receive(LONGEST_S)
            return why
    finally:
        axis.stop()


if __name__ == "__main__":
    try:
        sys.exit(f"hold_force: {main()}")
    except KeyboardInterrupt:
        pass
    except traction.Error as error:
        sys.exit(f"hold_force: {error}")

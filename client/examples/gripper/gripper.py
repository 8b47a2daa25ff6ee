"""Picks up a thing between two fingers, holds it as lightly as is safe, and puts it down: grip.py decides, this connects.

usage: gripper.py LEFT RIGHT COMMANDS OPENING_MM [JERK]   two instances of tractiond, each with its traction-touch; a
ZeroMQ endpoint (PUSH) that takes "OPENING HEIGHT" in metres, as traction-twin has one; the opening at the start; the
acceleration of the hand that is to be held [m/s^2]. Both cameras take 60 frames/s.
"""

import sys

import traction
import zmq
from grip import Finger, Grip, Phase


class Side:
    """One finger's newest frame."""

    def __init__(self, instance: str) -> None:
        self.subscriber = traction.Subscriber(instance, topics=traction.Topics.FIELD | traction.Topics.CONTACTS)
        self.finger, self.frame, self.felt = Finger(), 0, 0
        self.basis = b"", b""  # start of the daemon and zero, of the last field without a touch

    def next(self) -> bool:
        """Waits for the next frame and its contacts; false if it does not come, is not valid, or is of another zero."""
        last, waits = self.frame, False
        while message := self.subscriber.receive(0.5):
            basis = message.header.boot, message.header.zero
            if isinstance(message, traction.Contacts) and message.valid and basis == self.basis:  # else nothing is known
                self.felt, self.finger = message.header.frame_number, Finger()
                for contact in message.contacts:
                    x, y, z = map(float, contact.force_N)
                    if z > self.finger.normal_N:  # the strongest one
                        slides = contact.slip is not None and contact.slip.state is traction.SlipState.SLIPPING
                        self.finger = Finger(z, -x, -y, slides)
            elif isinstance(message, traction.Field):
                self.frame = message.header.frame_number
                if not self.finger.touches:
                    self.basis = basis
                if not message.valid or basis != self.basis:  # by another zero, what is held weighs nothing
                    return False
                waits = bool(message.contacts)  # they come before or after it
                if not waits:
                    self.finger = Finger()
            if self.frame != last and (not waits or self.felt == self.frame):
                return True
        return False


def main() -> str:
    left, right = Side(sys.argv[1]), Side(sys.argv[2])
    commands = zmq.Context.instance().socket(zmq.PUSH)
    commands.connect(sys.argv[3])
    grip = Grip(1e-3 * float(sys.argv[4]), float(sys.argv[5]) if len(sys.argv) > 5 else 3.0)
    said, last, blind = None, 0, 0
    while grip.phase not in (Phase.DONE, Phase.FAILED):
        seen = [side.next() for side in (left, right)]
        if all(seen):
            grip.step(left.finger, right.finger, min((left.frame - last) / 60 if last else 0.0, 0.05))
            last, blind = left.frame, 0
        elif (blind := blind + 1) == 20:  # without either it stays as it is
            return f"nothing valid comes from {sys.argv[2 if seen[0] else 1]}, so whether it is held is not known: stopped, and not opened"
        commands.send_string(f"{grip.opening_m:.7f} {max(grip.height_m, 0.0):.7f}")
        if grip.phase is not said:
            said = grip.phase
            print(f"{said.name.lower():6s} normal {left.finger.normal_N:.2f} N of {grip.wanted_N:.2f} N wanted, friction "
                  f"{grip.friction:.2f}, weight {2e3 * grip.carried_N:.0f} mN", flush=True)
    return "" if grip.phase is Phase.DONE else "it was not held"


if __name__ == "__main__":
    if why := main():
        sys.exit(f"gripper: {why}")

"""traction-touch beside twin, daemon and clients: contacts begin, last and end, also when something of these is stopped."""

import collections
import pathlib
import signal
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client" / "python"))
import rig  # noqa: E402
import traction  # noqa: E402
from traction import ContactPhase  # noqa: E402

BEGIN, MOVE, END = ContactPhase.BEGIN, ContactPhase.MOVE, ContactPhase.END


def touch(bench, daemon, ready=True, name="touch"):
    """traction-touch of a daemon, with its sockets in a directory of the test."""
    process = bench.start(rig.BIN / "traction-touch", "--connect", daemon.endpoint["stream"], "--runtime", bench.folder / name)
    process.endpoint = f"ipc://{bench.folder / name / 'stream'}"
    if ready:
        process.wait_for("listening.*ipc")
    return process


class Account:
    """What a subscriber is told of contacts. Fails where a begin or an end is told twice, or is missing."""

    def __init__(self, test, subscriber):
        self.test, self.subscriber = test, subscriber
        self.open, self.phases = {}, collections.defaultdict(list)  # (run, id) -> contact; all its phases

    def until(self, wanted):
        """Receives until `wanted(message)`; returns that message."""
        deadline = time.monotonic() + rig.HUNG_S * rig.PATIENCE
        while time.monotonic() < deadline:
            message = self.subscriber.receive(1.0)
            if message is None:
                continue
            for contact in message.contacts:
                key = next((key for key in self.open if key[1] == contact.id), (message.run, contact.id))
                self.test.assertEqual(key in self.open, contact.phase is not BEGIN, (key, contact.phase))
                self.phases[key].append(contact.phase)
                self.open[key] = contact
                if contact.phase is END:
                    del self.open[key]
            if wanted(message):
                return message
        self.test.fail("that did not come")


def is_pressed(message):
    return any(contact.force_N[2] > 2.0 for contact in message.contacts)


class Touch(unittest.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())

    def follow(self, endpoint):
        return Account(self, self.enterContext(traction.Subscriber(endpoint=endpoint, topics=traction.Topics.CONTACTS)))

    def test_contacts_end_when_the_daemon_or_traction_touch_is_stopped_or_killed(self):
        self.bench.twin("hold")
        daemon = self.bench.daemon()
        first = touch(self.bench, daemon)
        account = self.follow(first.endpoint)
        account.until(is_pressed)
        self.assertEqual(daemon.stop(), 0, daemon.output())
        account.until(lambda _: not account.open)

        daemon = self.bench.daemon(state=daemon.state)
        account.until(is_pressed)
        self.assertEqual(first.stop(), 0, first.output())
        ends = account.until(lambda _: not account.open)
        self.assertNotEqual(ends.header.sequence, 0)

        second = touch(self.bench, daemon)
        account.until(is_pressed)
        late = self.follow(second.endpoint)
        self.assertIn(BEGIN, [contact.phase for contact in late.until(is_pressed).contacts])
        second.stop(signal.SIGKILL)
        for each in (account, late):
            ends = each.until(lambda _: not each.open)
            self.assertFalse(ends.valid)

        third = touch(self.bench, daemon)  # in the place of the socket file that the second one left
        account.until(is_pressed)
        third.stop(signal.SIGKILL)
        touch(self.bench, daemon)  # at once: what has begun ends in the first message of the next run, or by the silence
        run = next(iter(account.open))[0]
        account.until(lambda message: message.run != run and is_pressed(message))
        self.assertFalse([key for key in account.open if key[0] == run])

    def test_tractionctl_finds_it_or_starts_it(self):
        self.bench.twin("hold")
        daemon = self.bench.daemon()
        session = self.bench.folder / "session"
        (session / "tractiond").mkdir(parents=True)
        (session / "tractiond" / "default").symlink_to(self.bench.folder / "default" / "run")
        session = {"XDG_RUNTIME_DIR": str(session)}
        alone = self.bench.start(rig.BIN / "tractionctl", "touch", env=session)
        alone.wait_for("traction-touch: listening at ipc://.*/session/traction-touch/default/stream")
        alone.wait_for(r"^contact \d+ .* begins +at .* radius")
        beside = self.bench.start(rig.BIN / "tractionctl", "touch", env=session)
        beside.wait_for(r"^contact \d+ .* begins +at ")
        beside.wait_for(r"^contact \d+ .* lasts .* torque .* stick ratio (unknown|0\.\d\d)")
        watch = self.bench.start(rig.BIN / "tractionctl", "watch", env=session)
        watch.wait_for(r"contact \d+ .* N stick (unknown|0\.\d\d)")
        self.assertNotIn("listening", beside.output())
        echo = self.bench.start(rig.BIN / "tractionctl", "echo", "--topic", "contacts", env=session)
        echo.wait_for('"topic":"contacts".*"phase":"begin"')
        alone.stop()  # and its traction-touch with it
        for each in (beside, echo):
            each.wait_for(r"contact \d+ .* ends|\"phase\":\"end\"")
        self.assertEqual(daemon.stop(), 0, daemon.output())

    def test_a_second_one_of_the_same_instance_is_refused(self):
        self.bench.twin("idle", ready=False)
        daemon = self.bench.daemon(ready=False)
        daemon.wait_for("listening|wait|running")
        touch(self.bench, daemon)
        second = touch(self.bench, daemon, ready=False)
        self.assertEqual(second.join(), 75)
        self.assertIn("in use by another traction-touch", second.output())
        self.assertEqual(len(second.lines), 1, second.output())
        other = touch(self.bench, daemon, ready=False, name="other")  # the port is the first one's
        self.assertEqual(other.join(), 69)
        self.assertIn("--instance", other.output())

if __name__ == "__main__":
    unittest.main()

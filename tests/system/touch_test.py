"""traction-touch beside twin, daemon and clients: contacts begin, last and end, also when something of these is stopped; and
fields of several sensors are one hand's."""

import collections
import pathlib
import signal
import sys
import threading
import time
import unittest
import unittest.mock

import numpy as np
import zmq

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client" / "python"))
import rig  # noqa: E402
import traction  # noqa: E402
from traction import ContactPhase, FingerState  # noqa: E402

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


class Touch(rig.TestCase):
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

    def test_a_press_that_is_not_seen_is_not_said_to_be_lifted(self):
        self.bench.twin("hold")
        daemon = self.bench.daemon()
        account = self.follow(touch(self.bench, daemon).endpoint)
        account.until(is_pressed)
        daemon.child.send_signal(signal.SIGSTOP)  # as on a starved box: the thing is still held
        ends = account.until(lambda _: not account.open)
        daemon.child.send_signal(signal.SIGCONT)
        causes = {contact.end_cause.name for contact in ends.contacts}
        print(f"  the daemon stands still while a press is held: the contact ends as {causes}; right: NOT_SEEN, it may last")
        self.assertEqual(causes, {"NOT_SEEN"})
        account.until(is_pressed)

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


class Fingers:
    """Daemons of two fingers, whose cameras are triggered together at 60 frames/s: what they publish of forces that are given."""

    def __init__(self, folder, **forces):
        self.forces, self.sensors = forces, {name: name for name in forces}
        self.context, self.stopping = zmq.Context(), threading.Event()
        self.sockets = {}
        for name in forces:
            (folder / "tractiond" / name).mkdir(parents=True)
            self.sockets[name] = self.context.socket(zmq.PUB)
            self.sockets[name].bind(f"ipc://{folder / 'tractiond' / name / 'stream'}")
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        frame = 0
        while not self.stopping.wait(1 / 60):
            frame, now = frame + 1, time.monotonic_ns()
            for name, force in list(self.forces.items()):
                field = rig.messages.Field(timestamp=1.0, valid=True)
                header = field.header
                header.sensor, header.boot = self.sensors[name], name.encode().ljust(16)
                header.sequence = header.frame_number = frame
                header.captured_ns, header.captured_error_ns, header.captured_bound = now, 100_000, 1
                field.resultant_N.x, field.resultant_N.y, field.resultant_N.z = force
                field.resultant_covariance_N2.noise.extend((0.01**2 * np.eye(3)).ravel())
                topic = f"traction/v1/{header.sensor}/field/".encode()
                self.sockets[name].send_multipart([topic, field.SerializeToString(), b"1.0"])

    def close(self):
        self.stopping.set()
        self.thread.join()
        self.context.destroy(linger=0)


class Hand(rig.TestCase):
    FILE = rig.SOURCE / "config" / "hand.toml"

    def setUp(self):
        super().setUp()
        self.enterContext(unittest.mock.patch.dict("os.environ", XDG_RUNTIME_DIR=str(self.bench.folder)))

    def hand(self, file, *more):
        return self.bench.start(rig.BIN / "traction-touch", "--hand", file, "--runtime",
                                self.bench.folder / "traction-touch" / "gripper", *more)

    def until(self, subscriber, wanted):
        deadline = time.monotonic() + rig.HUNG_S * rig.PATIENCE
        while time.monotonic() < deadline:
            message = subscriber.receive(1.0)
            if message is not None and wanted(message):
                return message
        self.fail("that did not come")

    def test_two_fingers_that_hold_something_are_one_grasp(self):
        fingers = Fingers(self.bench.folder, left=(0.1, -0.3, 2.0), right=(0.1, -0.3, 2.0))
        self.addCleanup(fingers.close)
        hand = self.hand(self.FILE)
        hand.wait_for("listening")
        clients = [self.bench.start(rig.BIN / "tractionctl", *words, "--instance", "gripper")
                   for words in (["touch"], ["echo", "--topic", "grasp"])]
        subscriber = self.enterContext(traction.Subscriber("gripper", topics=traction.Topics.GRASP))
        grasp = self.until(subscriber, lambda grasp: grasp.valid)
        # It is pressed from both sides, weighs 0.6 N, and is not turned: x of one gel is against that of the other.
        np.testing.assert_allclose(grasp.force_N, [0, 0, -0.6], atol=1e-9)
        np.testing.assert_allclose(grasp.moment_Nm, [0, 0, 0.1 * 0.044], atol=1e-9)
        np.testing.assert_allclose(grasp.force_covariance_N2.deviation, 0.01 * 2**0.5)
        self.assertEqual([finger.link for finger in grasp.fingers], ["left_gel", "right_gel"])
        self.assertEqual(grasp.fingers[0].frame_number, grasp.fingers[1].frame_number)
        self.assertEqual(grasp.header.captured_error_ns, 100_000)
        clients[0].wait_for(r"^hand gripper  force .0\.000 .0\.000 -0\.600 N \(deviations 0\.014 .*  moment .* \+4\.40 mN m")
        clients[1].wait_for('"topic":"grasp".*"valid":true.*"state":"matched"')
        hand.wait_for("all fingers are matched")

        fingers.sensors["right"] = "left"
        self.until(subscriber, lambda grasp: {finger.state for finger in grasp.fingers} == {FingerState.AMBIGUOUS})
        fingers.sensors["right"] = "right"
        self.until(subscriber, lambda grasp: grasp.valid)
        force = fingers.forces.pop("right")
        grasp = self.until(subscriber, lambda grasp: grasp.fingers[1].state is FingerState.MISSING)
        self.assertFalse(grasp.valid)
        self.assertFalse(grasp.force_N.any())
        clients[0].wait_for(r"^hand gripper .* right: missing")
        hand.wait_for("right: no frames come")
        fingers.forces["right"] = force
        self.until(subscriber, lambda grasp: grasp.valid)
        self.assertEqual(hand.stop(), 0, hand.output())

"""A thread that hangs, whosever it is: systemd's watchdog fires within a second, or the daemon mends it by itself."""

import time

import freezer
import rig
import steady

WATCHDOG_S = 0.8  # WatchdogSec= of the unit
NOTICED_S = 1.0 + steady.STEADY_S
# Nobody watches these (docs/security.md): no field comes, and each subscriber sees that.
UNWATCHED = {"ZMQbg/IO/0"}
# Fields flow without them, or again within four seconds. Besides, of those with the program's name: the log's, not the main one.
MENDED = {"tr-preview", "tr-disk", "tr-compute", "tr-model", "libusb_event", "camera-keeper", "camera-calls", "arv_gv_stream", "ZMQbg/Reaper"}


class Stalls(steady.TestCase):
    def setUp(self):
        super().setUp()
        self.systemd = rig.Systemd(self.bench, WATCHDOG_S)

    def starved(self):
        """Since when, if the watchdog would have fired."""
        return self.systemd.fed[-1] + WATCHDOG_S if time.monotonic() > self.systemd.fed[-1] + WATCHDOG_S else None

    def test_every_thread(self):
        self.bench.twin("idle", truth=False)
        names = None
        while names is None or names:
            daemon = self.bench.daemon(env=self.systemd.env)
            subscriber = self.bench.subscribe(daemon)
            subscriber.collect(60)
            running = freezer.threads(daemon.child.pid)
            if names is None:
                names = sorted(running.values())
            number, name = names[:-1].count(names[-1]), names.pop()
            with self.subTest(name):
                tid = [tid for tid, other in sorted(running.items()) if other == name][number]
                begin = time.monotonic()
                with freezer.Frozen(tid):
                    noticed = None
                    last = begin
                    # Without Aravis's heartbeat the camera stops after three seconds: whoever opens it again waits
                    # for the thread that stands, and is noticed in turn.
                    while not noticed and time.monotonic() < max(begin + 4, last + 5 * rig.PATIENCE):
                        item = subscriber.receive(0.05)
                        if item is not None and item[0] == "field":
                            last = time.monotonic()
                        noticed = self.starved()
                        if time.monotonic() > begin + 4 and time.monotonic() - last < 0.5:
                            break
                    flows = time.monotonic() - last < 0.5
                said = "NOTHING"
                if noticed:
                    said = f"the watchdog fires after {noticed - begin:.2f} s, {max(noticed - last, 0):.2f} s after the last field"
                elif flows:
                    said = "fields flow"
                print(f"\n  {name:16} {said}", end=" ", flush=True)
                if name in UNWATCHED:
                    self.assertFalse(noticed)
                elif name in MENDED or (name == "tractiond" and tid != daemon.child.pid):
                    self.assertTrue(flows)
                else:
                    self.assertTrue(noticed)
                    self.assertLess(noticed - begin, NOTICED_S)
            daemon.kill()

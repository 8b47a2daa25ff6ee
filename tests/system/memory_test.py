"""A local program fills the daemon's memory up to MemoryMax=: the kernel kills it, and systemd starts it again."""

import sys
import time

import rig
import steady
import unit

HOARD = rig.SOURCE / "tests/support/hoard.py"
LIMIT_MiB = 600  # less than that of the unit, so that the test does not take the memory of a small machine
LOCK_S = 3.0  # for which a camera may be locked after a crash (docs/security.md)


class Memory(steady.TestCase):
    def test_the_daemon_at_its_limit(self):
        self.bench.twin("idle", "--rate", "60", truth=False)
        state = self.bench.folder / "state"
        with unit.Unit("tractiond", lambda: self.bench.daemon(state=state), LIMIT_MiB) as service:
            self.bench.subscribe(service.process).collect(60)
            before_MiB = service.process.memory_MiB()
            hoarder = self.bench.start(sys.executable, HOARD, service.process.endpoint["control"])
            hoarder.wait_for("hoarding")
            begin = time.monotonic()
            while not service.ready:
                self.assertLess(time.monotonic(), begin + 60 * rig.PATIENCE)
                time.sleep(0.01)
            self.bench.subscribe(service.process).collect(1)
            first_s = time.monotonic() - service.died[0]
            self.assertEqual(hoarder.join(), 0, hoarder.output())
            print(f"\n  {before_MiB:.0f} -> {service.peak_MiB:.0f} MiB by {hoarder.lines[-1]}, killed {service.died[0] - begin:.2f} s after "
                  f"that began; first field {first_s:.2f} s after the end, of which RestartSec= {service.pause_s} s ", end="", flush=True)
            self.assertLess(first_s, LOCK_S + 0.5 * rig.PATIENCE)

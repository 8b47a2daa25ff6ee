"""Everything that goes wrong around a daemon and a gateway, at random, and an account of it at the end.

usage: soak.py [--minutes N] [--seed S]     N = 0: each fault once, shortly. Ends with 0 only if everything held.
In a network namespace of its own, with 127.0.0.2 at its loopback (tools/soak sees to it).

Each round has every fault once, in an order drawn anew; some come two at a time. After each, fields must flow again.
"""

import argparse
import collections
import contextlib
import fcntl
import random
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import zmq

import faults
import honest
import pauses
import rig
import seed

WATCHDOG_S = 0.8  # WatchdogSec= of the unit
NEVER_S = 30.0  # without a field for longer the instrument has not recovered
FLAT_MIB, ROUND_MIB = 4.0, 64.0  # by how much memory may grow in the steady state, and in the first round
SCENARIO = """format = 1
period_s = 8
[[contacts]]
shape = "hertz"
radius_mm = 2.5
time_s = [3, 3.5, 6, 6.5]
x_mm = [{0}, {0}, {1}, {1}]
y_mm = [{2}, {2}, {3}, {3}]
force_x_n = [0, {4}, 0, 0]
force_z_n = [0, 2, 2, 0]
"""


class Soak(faults.Faults):
    def __init__(self, bench, seed_number, minutes):
        self.bench, self.seconds = bench, 60 * minutes
        self.brief = 1.0 if minutes else 0.25
        self.draw = random.Random(seed_number)
        self.begin = time.monotonic()
        self.recoveries = collections.defaultdict(list)  # name -> (instrument, remote) [s]
        self.memory = []  # (when [s], daemon [MiB], gateway [MiB])
        self.wrong = []
        self.deaths = self.alarms = self.gateway_deaths = 0
        self.gateway_peak = 0.0
        self.unread, self.gateway_away = threading.Event(), threading.Event()
        self.drained, self.draining, self.over = [], threading.Lock(), threading.Event()
        self.truth = honest.Truth()
        self.pauses = bench.enter_context(pauses.Pauses())

    # What there is.

    def set_up(self, seed_number):
        self.wire = self.bench.start(sys.executable, rig.SOURCE / "tests/support/wire.py", faults.NEAR, faults.CAMERA,
                                     seed_number, faults.STRANGER, stdin=subprocess.PIPE)
        self.wire.wait_for("ready")
        self.inside = f"/proc/{self.wire.child.pid}/ns/net"
        place = [round(self.draw.uniform(-8, 8), 2) for _ in range(4)]
        self.scenario = self.bench.folder / "soak.toml"
        self.scenario.write_text(SCENARIO.format(*place, round(self.draw.uniform(-0.5, 0.5), 2)))
        self.cameras = 0
        self.plug_camera()
        self.systemd = rig.Systemd(self.bench, WATCHDOG_S)
        self.start_daemon()
        ada, eve = (tuple(key.decode() for key in zmq.curve_keypair()) for _ in range(2))
        server = self.bench.allow("ada", ada[0], "--control")
        self.bench.allow("eve", eve[0], "--control")
        self.ada, self.eve = (server, *ada), (server, *eve)
        self.key_file = self.bench.folder / "ada.key"
        self.key_file.write_text(f'public = "{ada[0]}"\nsecret = "{ada[1]}"\nserver = "{server}"\n')
        self.key_file.chmod(0o600)
        self.gateway_at = "".join(f'{name} = ["tcp://127.0.0.1:*"]\n' for name in self.daemon.endpoint)
        self.start_gateway()
        self.gateway_at = "".join(f'{name} = ["{at}"]\n' for name, at in self.gateway.endpoint.items())
        self.local = honest.Reader("stream", self.daemon.endpoint["stream"], told=self.truth.pending)
        self.latest = honest.Reader("latest", self.daemon.endpoint["latest"], newest_only=True)
        self.remote = honest.Reader("remote", self.gateway.endpoint["stream"], keys=self.ada)
        self.readers = (self.local, self.latest, self.remote)
        for one in self.readers:
            one.start()
        self.workers = [threading.Thread(target=work, daemon=True) for work in (self.drain, self.supervise, self.check)]
        for one in self.workers:
            one.start()

    def plug_camera(self):
        self.cameras += 1
        file = self.bench.folder / f"truth-{self.cameras}.jsonl"
        self.twin = self.bench.start("nsenter", f"--net={self.inside}", rig.BIN / "traction-twin", self.scenario, "--address",
                                     faults.CAMERA, "--cache", rig.cache_directory(), "--truth", file, "--rate", faults.RATE)
        self.truth.follow(file)
        self.twin.wait_for("ready", 60)

    def start_daemon(self):
        """`configuration` is what stands in its file; a reload takes what is new there."""
        self.configuration = f"frame_rate_hz = {faults.RATE}\n"
        self.time_of_day_file = self.bench.folder / "time_of_day"  # ahead of the true one [s]
        self.time_of_day_file.write_bytes(bytes(8))
        clock = {"LD_PRELOAD": rig.BUILD / "tests/support/traction_wall_clock.so",
                 "TRACTION_WALL_CLOCK": self.time_of_day_file}
        self.daemon = self.bench.daemon(self.configuration, camera=faults.CAMERA, env={**self.systemd.env, **clock})
        self.file = self.bench.folder / "default" / "tractiond.toml"
        self.configuration = self.file.read_text()
        self.ready, self.fed = time.monotonic(), None
        fcntl.fcntl(self.daemon.child.stdout, 1031, 4096)  # F_SETPIPE_SZ: a log that is soon full
        self.drained.append(self.daemon)

    def start_gateway(self):
        self.gateway = self.bench.gateway(self.daemon, self.gateway_at)
        rig.weigh(self.gateway, 10)  # as CPUWeight= of its unit
        self.drained.append(self.gateway)

    def end_process(self, process, how):
        with self.draining:
            if process in self.drained:
                self.drained.remove(process)
        return process.stop(how)

    # What looks on.

    def drain(self):
        while not self.over.wait(0.02):
            with self.draining:
                for one in self.drained:
                    if not (one is self.daemon and self.unread.is_set()):
                        one.read()

    def supervise(self):
        """As systemd does."""
        while not self.over.wait(0.02):
            if self.daemon.child.poll() is not None:
                self.deaths += 1
                self.blame(f"the daemon ended with {self.daemon.child.returncode}:\n{self.daemon.output()[-3000:]}")
                self.end_process(self.daemon, signal.SIGKILL)
                self.start_daemon()
            self.feel_for_stalls()
            if self.gateway.child.poll() is not None and not self.gateway_away.is_set():
                self.gateway_deaths += 1
                self.blame(f"the gateway ended with {self.gateway.child.returncode}:\n{self.gateway.output()[-3000:]}")
                self.start_gateway()
            with contextlib.suppress(OSError, IndexError):
                self.gateway_peak = max(self.gateway_peak, self.gateway.memory_MiB())

    def feel_for_stalls(self):
        """Whoever waits for a processor does not hang, and neither does who waits for him: that is the machine's."""
        fed = self.systemd.fed[-1]
        if fed != self.fed:  # how long each has waited until now
            self.fed, self.waited = fed, pauses.waited(self.daemon.child.pid)
        pause = time.monotonic() - max(fed, self.ready)
        if pause <= WATCHDOG_S:
            return
        time.sleep(0.1)  # what came meanwhile has not been read if it was we who stood still
        if self.systemd.fed[-1] != fed:
            return
        now = pauses.waited(self.daemon.child.pid)
        waited = sum(now[thread] - before for thread, before in self.waited.items() if thread in now)
        if pause > WATCHDOG_S + max(waited, self.pauses.longest_since(fed)):
            self.alarms += 1
            self.blame(f"the watchdog was not fed for {pause:.2f} s; its threads waited {waited:.2f} s for processors")
            self.daemon.child.send_signal(signal.SIGABRT)
            self.daemon.child.wait()

    def look_away(self):
        self.over.set()
        for one in self.workers:
            one.join()

    def check(self):
        while not self.over.wait(0.5):
            self.truth.check()

    def say(self, text):
        print(f"{time.monotonic() - self.begin:7.1f} s  {text}", flush=True)

    def blame(self, what):
        self.wrong.append(what)
        self.say(f"WRONG: {what}")

    # The course of it.

    def recovered(self, names):
        """Waits until fields flow again to every honest subscriber; how long it takes until the first of them."""
        begin, found = time.monotonic(), {}
        for one in self.readers:
            one.fault_ended()
        while len(found) < len(self.readers):
            for one in self.readers:
                after_s = one.recovered_after_s()
                if after_s is not None:
                    found.setdefault(one, after_s)
            if time.monotonic() - begin > NEVER_S:
                missing = [one.name for one in self.readers if one not in found]
                self.blame(f"after {names}: no field for {missing} within {NEVER_S:.0f} s; the daemon said\n"
                           f"{self.daemon.output()[-2000:]}")
                found.update({one: NEVER_S for one in self.readers if one not in found})
            time.sleep(0.002)
        for name in names:
            self.recoveries[name].append((max(found[self.local], found[self.latest]), found[self.remote]))

    def calm(self, draw, at_least=1.0, at_most=4.0):
        """Fields flow, whoever reads; here at least half of what the camera sends."""
        before, first = [one.fields for one in self.readers], self.local.field.header.camera_frame_id
        begin = time.monotonic()
        time.sleep(draw.uniform(at_least, at_most if self.seconds else at_least))
        came = [one.fields - count for one, count in zip(self.readers, before)]
        sent = (self.local.field.header.camera_frame_id - first) % 65535
        if came[0] < 0.5 * sent or not all(came):
            self.blame(f"without a fault {came} fields of {sent} in {time.monotonic() - begin:.2f} s")
        with contextlib.suppress(OSError):  # that one of them has just ended is said elsewhere
            self.memory.append((begin - self.begin, self.daemon.memory_MiB(), self.gateway.memory_MiB()))

    def run(self):
        self.recovered([])
        while self.ctl("zero")[0] != 0:  # a person confirms it; refused while something presses
            time.sleep(0.5)
        self.calm(self.draw, 4, 4)
        begin = time.monotonic()
        rounds, end = 0, begin + self.seconds
        while rounds == 0 or time.monotonic() < end:
            left = self.draw.sample(faults.FAULTS, len(faults.FAULTS))
            while left and (rounds == 0 or time.monotonic() < end):
                together = [left.pop()]
                if left and self.draw.random() < 0.3 and not left[-1].touched & together[0].touched:
                    together.append(left.pop())
                seeds = [self.draw.getrandbits(64) for _ in together]
                threads = [threading.Thread(target=self.perform, args=both) for both in zip(together, seeds)]
                for one in threads:
                    one.start()
                for one in threads:
                    one.join()
                self.recovered([one.__name__ for one in together])
                self.calm(self.draw)
            rounds += 1
            if rounds == 1 or time.monotonic() < begin + self.seconds / 3:
                self.steady = len(self.memory) - 1 if self.seconds else 0
        for _ in range(3):
            self.calm(self.draw, 1, 2)

    def perform(self, what, seed_number):
        begin = time.monotonic()
        try:
            said = what(self, random.Random(seed_number))
            self.say(f"{what.__name__:20} {seed_number:016x} since {begin - self.begin:.1f} s, "
                     f"at {self.memory[-1][1]:.1f} MiB: {said}")
        except Exception as error:  # the fault's own: the rest goes on, and the soak has not held
            self.blame(f"{what.__name__}: {type(error).__name__}: {error}")

    # The account of it.

    def finish(self):
        """The camera goes, all that is under way arrives, and then everything must add up."""
        self.twin.stop()
        settled = time.monotonic() + 3
        while time.monotonic() < settled:
            before = self.local.fields
            time.sleep(1.2)  # a status
            if self.local.fields == before and self.local.status.ledger.in_flight == 0:
                break
        self.look_away()
        ledger = self.local.status.ledger
        code = self.daemon.stop()
        if code != 0:
            self.blame(f"the daemon ended with {code}:\n{self.daemon.output()[-2000:]}")
        said = re.search(r"(\d+) frames received, (\d+) published, (\d+) for the zero, (\d+) lost", self.daemon.output())
        account = [int(number) for number in said.groups()] if said else [0, 0, 0, -1]
        if (code := self.gateway.stop()) != 0:
            self.blame(f"the gateway ended with {code}:\n{self.gateway.output()[-2000:]}")
        for one in self.readers:
            one.ending = True
            one.join()
        self.truth.check(all_of_them=True)
        return ledger, account

    def report(self):
        ledger, account = self.finish()
        truth, local, remote = self.truth, self.local, self.remote
        rows = []

        def row(name, text, held):
            rows.append(held)
            print(f"{name:12} {'held  ' if held else 'BROKEN'} {text}")

        lost = {loss: getattr(ledger, loss) for loss in honest.LOSSES if getattr(ledger, loss)}
        row("frames", f"{ledger.received} in = {ledger.published} published + "
            f"{' + '.join(f'{count} {loss}' for loss, count in lost.items())}; besides, {ledger.missing} missing; "
            f"the cameras sent {truth.sent}; at the end {account[0]} = {account[1]} + {account[2]} + {account[3]}",
            ledger.received == ledger.published + sum(lost.values()) and account[0] == sum(account[1:]) and
            account[:2] == [ledger.received, ledger.published])
        newest = local.boots[local.field.header.boot]
        row("subscribers", f"local: {local.fields} fields of {newest - local.first + 1}, {local.lost} lost; "
            f"remote: {remote.fields}, and {remote.lost} lost; latest: {self.latest.fields}",
            local.lost == 0 and newest == ledger.published and local.fields == newest - local.first + 1 and
            not any(one.wrong for one in self.readers))
        gaps = np.diff(self.systemd.fed)
        row("restarts", f"{self.deaths} of the daemon, {self.gateway_deaths} of the gateway that nobody killed",
            self.deaths + self.gateway_deaths == 0)
        row("watchdog", f"{self.alarms} false alarms; longest pause {gaps.max():.2f} s of {WATCHDOG_S} s, of the machine itself "
            f"{self.pauses.longest:.2f} s", self.alarms == 0)
        when, daemon, gateway = np.array(self.memory[self.steady:]).T
        half = len(when) // 2
        # What those who hang take is given back, but not at once: what counts is what it comes down to.
        grown = daemon[half:].min() - daemon[:half].min()
        slope = np.median([(daemon[j] - daemon[i]) / (when[j] - when[i]) for i in range(len(when)) for j in range(i)])
        row("memory", f"daemon from {when[0]:.0f} s on {np.median(daemon[:half]):.1f}, then {np.median(daemon[half:]):.1f} MiB, "
            f"at most {daemon.max():.1f}; at least {daemon[:half].min():.1f}, then {grown:+.1f}; {60 * slope:+.3f} MiB/min; "
            f"gateway {gateway[-1]:.1f}, at most {self.gateway_peak:.1f} MiB", grown < (FLAT_MIB if self.seconds else ROUND_MIB))
        row("fields", f"{truth.checked} without a flag: {len(truth.invented)} invented, {len(truth.untrue)} untrue (the worst "
            f"{truth.worst_N:.2f} N), {len(truth.disordered)} with times that go back; {truth.flagged} flagged; "
            f"{truth.unrecorded} of cameras that died before they told",
            truth.checked > 0 and not truth.invented + truth.untrue + truth.disordered)
        for name in (one.__name__ for one in faults.FAULTS):
            found = np.array(self.recoveries[name])
            worst = found.max(axis=0)
            row(f"  {name:20}", f"{len(found):3} times: first field {np.median(found[:, 0]):.2f} s, at most {worst[0]:.2f} s; "
                f"remote {np.median(found[:, 1]):.2f} s, at most {worst[1]:.2f} s", worst.max() < NEVER_S)
        wrong = self.wrong + [text for one in self.readers for text in one.wrong[:5]]
        if truth.untrue or truth.invented:
            wrong.append(f"untrue (number, N): {truth.untrue[:20]}, invented: {truth.invented[:20]}")
        for text in wrong:
            print(f"WRONG: {text}")
        return all(rows) and not wrong


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--minutes", type=float, default=20)
    arguments.add_argument("--seed", type=int, default=seed.fresh())
    given = arguments.parse_args()
    print(f"seed {given.seed}", flush=True)
    with rig.Rig() as bench:
        soak = Soak(bench, given.seed, given.minutes)
        soak.set_up(given.seed)
        try:
            soak.run()
            held = soak.report()
        finally:
            soak.look_away()
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    main()

"""traction-input beside a publisher of fields, and what programs that are not ours read of it: oscdump, libspnav, TUIO's clients."""

import ctypes
import json
import os
import pathlib
import socket
import threading
import time
import unittest
import unittest.mock

import numpy as np
import rig
import suite
import zmq
from deadline import HUNG_S

TUIO = pathlib.Path(os.environ.get("TRACTION_TUIO", rig.BUILD / "tests" / "system" / "tuio"))
INPUT = rig.BIN / "traction-input"


class Gel:
    """A daemon's stream of fields, 60 a second, with the contacts that are given: (x_mm, y_mm, force_N); and with tractions that
    grow by `spread_Pa_m` from the middle outwards.
    """

    GRID, PITCH_M, CALIBRATION = 24, 3e-3, b"calibration".ljust(16)

    def __init__(self, folder):
        self.endpoint = f"ipc://{folder / 'stream'}"
        self.contacts, self.valid, self.silent, self.spread_Pa_m = [], True, False, 0.0
        self.sent = {}  # frame number -> when its field was sent
        self.context, self.stopping = zmq.Context(), threading.Event()
        self.socket = self.context.socket(zmq.PUB)
        self.socket.bind(self.endpoint)
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        frame = 0
        while not self.stopping.wait(1 / 60):
            if self.silent:
                continue
            frame += 1
            field = rig.messages.Field(timestamp=1.0, valid=self.valid)
            header = field.header
            header.sensor, header.boot, header.sequence, header.frame_number = "gel", b"boot".ljust(16), frame, frame
            header.captured_ns = time.monotonic_ns()
            wrench = np.zeros(6)
            for x_mm, y_mm, force in self.contacts if self.valid else ():
                contact = field.contacts.add(area_m2=5e-5, area_deviation_m2=1e-6)
                contact.position_m.x, contact.position_m.y = 1e-3 * x_mm, 1e-3 * y_mm
                contact.position_deviation_m.x = contact.position_deviation_m.y = 2e-5
                contact.force_N.x, contact.force_N.y, contact.force_N.z = force
                for axis in "xyz":
                    setattr(contact.force_deviation_N, axis, 0.01)
                contact.half_axes_m.x, contact.half_axes_m.y = 5e-3, 4e-3
                wrench += [*force, *np.cross([1e-3 * x_mm, 1e-3 * y_mm, 0.0], force)]
            field.resultant_N.x, field.resultant_N.y, field.resultant_N.z = wrench[:3]
            field.moment_Nm.x, field.moment_Nm.y, field.moment_Nm.z = wrench[3:]
            if self.spread_Pa_m:
                self.spread(field)
            self.sent[frame] = time.monotonic()
            self.socket.send_multipart([b"traction/v1/gel/field/", field.SerializeToString(), b"1.0"])

    def spread(self, field):
        """Adds the nodes' forces, and tells first where the nodes are."""
        description = rig.messages.Description(header=field.header, nodes={"columns": self.GRID, "rows": self.GRID, "pitch_m": self.PITCH_M})
        description.calibration.id = field.header.calibration = self.CALIBRATION
        self.socket.send_multipart([b"traction/v1/gel/description/", description.SerializeToString(), b"1.0"])
        along = self.PITCH_M * (np.arange(self.GRID) - (self.GRID - 1) / 2)
        x, y = np.meshgrid(along, along)
        force = self.PITCH_M**2 * self.spread_Pa_m * np.stack([x, y, 0 * x], axis=-1)
        force[..., 2] = np.where(np.hypot(x, y) < 8e-3, 0.1, 0.0)
        field.force_N.extend(force.ravel())
        field.node_deviation_N.extend([1e-4] * force.size)
        field.node_valid = b"\1" * self.GRID**2

    def close(self):
        self.stopping.set()
        self.thread.join()
        self.context.destroy(linger=0)


class Motion(ctypes.Structure):
    """spnav_event of spnav.h, as far as it is of motion."""
    _fields_ = [("type", ctypes.c_int), *((name, ctypes.c_int) for name in ("x", "y", "z", "rx", "ry", "rz")),
                ("period", ctypes.c_uint), ("data", ctypes.c_void_p), ("room", ctypes.c_char * 64)]


class InputDevice(rig.TestCase):
    def setUp(self):
        super().setUp()
        self.gel = Gel(self.bench.folder)
        self.addCleanup(self.gel.close)

    def use(self, profile, *more):
        file = self.bench.folder / "profile.toml"
        file.write_text(profile)
        return self.bench.start(INPUT, "--profile", file, "--connect", self.gel.endpoint, *more)

    def until(self, process, event, **wanted):
        """The next line of JSON of `process` with this event and values near these."""
        deadline = time.monotonic() + HUNG_S * rig.PATIENCE
        while time.monotonic() < deadline:
            process.read(0.1)
            while process.lines:
                told = json.loads(process.lines.pop(0))
                self.assertNotEqual(told.get("event"), "error", told)
                if told.get("event") == event and all(abs(told[key] - value) < 1e-3 for key, value in wanted.items()):
                    return told
        self.fail(f"no {event} with {wanted}")

    def dump(self):
        """oscdump, with its port."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        return self.bench.start("oscdump", "-L", port), port

    def test_oscdump_reads_the_touches_of_the_fields_and_each_is_lifted(self):
        dump, port = self.dump()
        device = self.use(f'[osc]\naddress = "127.0.0.1:{port}"\nprefix = "/gel"')
        self.gel.contacts = [(10.0, -5.0, (0.25, 0.5, 2.0))]
        # The user sees the gel from the other side than the camera.
        dump.wait_for(r"/gel/touch ifffffff 1 -10\.0+ -5\.0+ -0\.250* 0\.50* 2\.0+ -?0\.0+ 3\.989")
        dump.wait_for(r"/gel/wrench ffffff -0\.250* 0\.50* -2\.0+ 10\.0+ -20\.0+ -6\.250*")
        dump.wait_for(r"/gel/affine fff 0\.0+ 0\.0+ 0\.0+")
        self.gel.spread_Pa_m = 1e6  # 2 kPa/mm of dilation, less the dead zone
        dump.wait_for(r"/gel/affine fff 1\.(4999|5000)\d* -?0\.0+ -?0\.0+")
        self.gel.spread_Pa_m = 0.0
        dump.wait_for(r"/gel/gesture ffff 0\.0+ 0\.0+ 0\.0+ 1\.0+")
        self.gel.silent = True  # in the middle of a touch
        dump.wait_for(r"/gel/lift i 1$")
        self.gel.silent = False
        dump.wait_for(r"/gel/touch ifffffff 2 ")
        self.gel.valid = False
        dump.wait_for(r"/gel/lift i 2$")
        self.gel.valid = True
        dump.wait_for(r"/gel/touch ifffffff 3 ")
        self.assertEqual(device.stop(), 0, device.output())
        dump.wait_for(r"/gel/lift i 3$")

    @unittest.skipIf(os.geteuid() != 0, "this user may not change /etc/hosts for a program")
    def test_localhost_is_where_programs_listen_though_hosts_has_the_other_address_first(self):
        dump, port = self.dump()
        hosts, profile = self.bench.folder / "hosts", self.bench.folder / "profile.toml"
        hosts.write_text("::1 localhost ip6-localhost\n127.0.0.1 localhost\n")
        profile.write_text(f'[osc]\naddress = "localhost:{port}"')
        self.bench.start("unshare", "--mount", "sh", "-c", 'mount --bind "$0" /etc/hosts && exec "$@"', hosts,
                         INPUT, "--profile", profile, "--connect", self.gel.endpoint)
        self.gel.contacts = [(10.0, -5.0, (0.25, 0.5, 2.0))]
        print(f"\n  OSC to localhost, of ::1 and 127.0.0.1: {dump.wait_for('/traction/touch ')[-60:]!r}; right: the touch", end=" ")

    def test_a_program_on_libspnav_reads_the_wrench_as_six_axes(self):
        path = self.bench.folder / "spnav.sock"
        self.enterContext(unittest.mock.patch.dict("os.environ", SPNAV_SOCKET=str(path)))
        device = self.use(f'[spacenav]\nsocket = "{path}"\ncounts_per_N = 100')
        device.wait_for("listening at")
        mode = path.stat().st_mode & 0o777
        print(f"\n  the socket of 3-D mice, made by {'root' if os.geteuid() == 0 else 'a user'}: mode {mode:o}; right: 666 of root, of all programs, "
              "as spacenavd's", end=" ")
        if os.geteuid() == 0:
            self.assertEqual(mode, 0o666)
        spnav = ctypes.CDLL("libspnav.so.0")
        for _ in range(2):  # the second time while it is pressed
            self.assertEqual(spnav.spnav_open(), 0)
            self.gel.contacts = [(10.0, -5.0, (0.7, 0.5, 2.2))]
            # Force (-0.7, 0.5, -2.2) N and moment (11, -22, -8.5) N mm for the user, less the dead zones.
            self.motion(spnav, [-50, -200, 30, -35, 22, 90])
            spnav.spnav_close()
        self.assertEqual(spnav.spnav_open(), 0)
        self.motion(spnav, [-50, -200, 30, -35, 22, 90])
        self.gel.contacts = []
        self.motion(spnav, [0] * 6)
        second = self.use(f'[spacenav]\nsocket = "{path}"')
        self.assertEqual(second.join(), 69, second.output())
        self.assertRegex(second.output(), "in use by another program; is it spacenavd's")
        spnav.spnav_close()
        self.assertEqual(device.stop(), 0, device.output())
        self.assertFalse(path.exists())

    def motion(self, spnav, wanted):
        deadline = time.monotonic() + HUNG_S * rig.PATIENCE
        event, seen = Motion(), None
        while time.monotonic() < deadline:
            if spnav.spnav_poll_event(ctypes.byref(event)) == 1:
                seen = [event.x, event.y, event.z, event.rx, event.ry, event.rz]
                if np.abs(np.subtract(seen, wanted)).max() <= 1:
                    return
            else:
                time.sleep(1e-3)
        self.fail(f"{seen} is not {wanted}")

    def lossy(self, port):
        """The port of a relay that loses, of each version of TUIO, the first bundle without a touch behind some with touches."""
        relay = self.enterContext(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        relay.bind(("127.0.0.1", 0))
        touched = set()

        def run():
            while bundle := relay.recv(4096):
                version = b"/tuio2/" in bundle
                if b"set\0" in bundle or b"/tuio2/ptr" in bundle:
                    touched.add(version)
                elif version in touched:
                    touched.remove(version)
                    continue
                relay.sendto(bundle, ("127.0.0.1", port))

        thread = threading.Thread(target=run)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(relay.sendto, b"", relay.getsockname())
        return relay.getsockname()[1]

    @suite.npm
    def test_clients_of_both_versions_of_tuio_follow_two_touches_though_each_lift_is_lost_once(self):
        client = self.bench.start("node", TUIO / "client.js")
        port = self.lossy(json.loads(client.wait_for("port"))["port"])
        client.lines.clear()
        profile = "".join(f'[{name}]\naddress = "127.0.0.1:{port}"\n' for name in ("tuio", "tuio2"))
        device = self.use(profile)
        self.gel.contacts = [(18.0, 4.5, (0.0, 2.5, 2.5))]
        self.until(client, "add", version=1, id=1, x=0.25, y=0.4375)
        self.until(client, "add", version=2, id=1, x=0.25, y=0.4375, vy=0.0, press=0.25, shear=np.pi / 4, radius=3.989 / 72)
        self.gel.contacts = [(18.0, 0.0, (0.0, 0.0, 2.5)), (-18.0, 0.0, (0.0, 0.0, 5.0))]
        self.until(client, "add", version=2, id=2, x=0.75, press=0.5)
        self.until(client, "update", version=1, id=1, y=0.5)
        self.gel.contacts.pop(0)
        self.until(client, "remove", version=1, id=1)
        self.gel.silent = True
        begin = time.monotonic()
        self.until(client, "remove", version=2, id=2)
        print(f"\n  a lift whose datagram was lost: the client of TUIO 2.0 knows after {time.monotonic() - begin:.1f} s; right: some 1 s", end=" ")
        self.gel.silent = False
        self.until(client, "add", version=2, id=3)
        self.assertEqual(device.stop(), 0, device.output())
        self.until(client, "remove", version=2, id=3)
        self.use(profile)  # which the same clients read
        self.until(client, "add", version=2, id=1)

    def test_an_address_that_is_none_is_refused_in_one_line(self):
        device = self.use('[osc]\naddress = "nowhere"')
        self.assertEqual(device.join(), 78, device.output())
        self.assertEqual(len(device.lines), 1, device.output())
        self.assertRegex(device.output(), "no address to send to.*HOST:PORT")

    @unittest.skipIf(os.access("/dev/uinput", os.W_OK), "this user may make input devices")
    def test_without_uinput_it_says_what_to_do(self):
        device = self.use("[pen]")
        self.assertIn(device.join(), (69, 77), device.output())
        self.assertRegex(device.output(), "/dev/uinput cannot be opened: .*; (load .*modprobe uinput|70-traction-input.rules .*usermod)")

    @suite.realtime
    def test_what_a_foreign_reader_gets_is_at_most_two_milliseconds_old(self):
        reader = self.enterContext(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        reader.bind(("127.0.0.1", 0))
        reader.settimeout(HUNG_S)
        self.use(f'[osc]\naddress = "127.0.0.1:{reader.getsockname()[1]}"')
        age = []
        for number in range(900):
            self.gel.contacts = [(0.001 * number, 0.0, (0.0, 0.0, 2.0))]
            reader.recv(4096)
            age.append(time.monotonic() - max(self.gel.sent.values()))
        p50, p99 = np.percentile(1e3 * np.array(age[100:]), (50, 99))
        print(f"\n  field sent -> datagram received: p50 {p50:.2f} ms, p99 {p99:.2f} ms ", end="", flush=True)
        self.assertLess(p99, 2.0)

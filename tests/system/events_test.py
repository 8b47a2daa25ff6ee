"""What a kernel makes of traction-input's devices, as evtest and libinput read them; in a machine of its own (tests/support/machine)."""

import pathlib
import re
import time

import rig
from input_device_test import Gel

GRAMS_250 = 250 * rig.GRAM_FORCE
LAG = "your system is too slow|event processing lagging"  # libinput's, of an emulated machine


class Events(rig.TestCase):
    def setUp(self):
        super().setUp()
        self.gel = Gel(self.bench.folder)
        self.addCleanup(self.gel.close)

    def use(self, table):
        """The device of a profile with this table, and two readers of it that are ready: evtest and libinput."""
        file = self.bench.folder / "profile.toml"
        file.write_text(table)
        device = self.bench.start(rig.BIN / "traction-input", "--profile", file, "--connect", self.gel.endpoint)
        name = device.wait_for("the input device is").split('"')[1]
        [path] = (pathlib.Path("/dev/input") / event.name for event in pathlib.Path("/sys/class/input").glob("event*")
                  if (event / "device/name").read_text().strip() == name)
        evtest = self.bench.start("stdbuf", "-oL", "evtest", path)
        evtest.wait_for("Testing")
        libinput = self.bench.start("stdbuf", "-oL", "libinput", "debug-events", "--verbose", "--device", path)
        libinput.wait_for("DEVICE_ADDED")
        return device, evtest, libinput

    def stop(self, device, evtest, libinput):
        """While something touches: the device ends, and libinput has warned of nothing."""
        self.assertEqual(device.stop(), 0, device.output())
        libinput.wait_for("DEVICE_REMOVED")
        evtest.wait_for("No such device")
        warnings = [line for line in libinput.lines if re.search("(?i)warn|error|bug", line) and not re.search(LAG, line)]
        self.assertEqual(warnings, [], libinput.output())

    def lose(self, *readers):
        """The sensor's fields end in the middle of a touch, and come again. What the last reader has read until then is forgotten."""
        self.gel.silent = True
        for reader, pattern in readers:
            reader.wait_for(pattern)
        reader.forget()
        self.gel.silent = False

    def test_touches_have_pressure_in_grams_and_all_are_lifted(self):
        device, evtest, libinput = self.use("[touch]\nfull_press_N = 20")
        ability = evtest.output()
        self.assertRegex(ability, r"\(ABS_MT_PRESSURE\)\n.*Value .*\n +Min +0\n +Max +2039\n +Resolution +1\n")
        self.gel.contacts = [(-10.0, 5.0, (0.0, 0.0, GRAMS_250))]
        evtest.wait_for(r"\(ABS_MT_PRESSURE\), value 250$")
        libinput.wait_for(r"TOUCH_DOWN .*\s0 \(0\).*\(46\.00/31\.00mm\)")
        self.gel.contacts = [*self.gel.contacts, (12.0, 0.0, (0.0, 0.0, 1.0))]
        libinput.wait_for(r"TOUCH_DOWN .*\s1 \(1\)")
        self.lose((libinput, r"TOUCH_UP .*\s0 \(0\)"), (libinput, r"TOUCH_UP .*\s1 \(1\)"), (evtest, r"\(BTN_TOUCH\), value 0"))
        evtest.wait_for(r"\(BTN_TOUCH\), value 1")
        evtest.wait_for(r"\(ABS_MT_SLOT\), value 1")
        self.stop(device, evtest, libinput)
        evtest.wait_for(r"\(BTN_TOUCH\), value 0")
        ids = re.findall(r"\(ABS_MT_TRACKING_ID\), value (-?\d+)", evtest.output())
        self.assertEqual(sum(1 if int(each) >= 0 else -1 for each in ids), 0, ids)
        self.assertEqual(*(len(re.findall(kind, libinput.output())) for kind in ("TOUCH_DOWN", "TOUCH_UP")), libinput.output())

    def test_a_pen_has_pressure_and_tilt_and_is_lifted(self):
        device, evtest, libinput = self.use("[pen]\nfull_press_N = 10")
        self.gel.contacts = [(-10.0, 5.0, (0.0, 0.0, GRAMS_250))]
        libinput.wait_for(r"TABLET_TOOL_TIP .*46\.00\*?/31\.00.*tilt: 0\.00.*pressure: 0\.2[45]\*? down")
        self.gel.contacts = [(-10.0, 5.0, (-1.0, 0.5, 2.0))]  # the user sees it from the other side than the camera
        evtest.wait_for(r"\(ABS_TILT_X\), value -27$")
        evtest.wait_for(r"\(ABS_TILT_Y\), value 14$")
        evtest.wait_for(r"\(ABS_PRESSURE\), value 819$")
        libinput.wait_for(r"tilt: -\d+\.\d+\*?/\d+\.\d+.*pressure: 0\.(19|20)")
        self.lose((libinput, r"TABLET_TOOL_TIP .* up$"), (evtest, r"\(BTN_TOOL_PEN\), value 0"))
        evtest.wait_for(r"\(BTN_TOUCH\), value 1")
        self.stop(device, evtest, libinput)
        for key in ("BTN_TOUCH", "BTN_TOOL_PEN"):
            evtest.wait_for(rf"\({key}\), value 0")
        tips = re.findall(r"TABLET_TOOL_TIP .* (down|up)$", libinput.output(), re.M)
        self.assertEqual(tips.count("down"), tips.count("up"), libinput.output())

    def test_a_mouse_moves_and_its_button_is_released(self):
        device, evtest, libinput = self.use("[pointer]")
        self.gel.contacts = [(0.0, 0.0, (0.5, 0.0, 2.5))]
        libinput.wait_for(r"POINTER_MOTION .*-\d+\.\d+/")  # to the user's left
        libinput.wait_for(r"POINTER_BUTTON .*BTN_LEFT.*pressed")
        self.lose((libinput, r"POINTER_BUTTON .*BTN_LEFT.*released"), (evtest, r"\(BTN_LEFT\), value 0"))
        evtest.wait_for(r"\(BTN_LEFT\), value 1")
        self.stop(device, evtest, libinput)
        evtest.wait_for(r"\(BTN_LEFT\), value 0")
        buttons = re.findall(r"BTN_LEFT.* (pressed|released)", libinput.output())
        self.assertEqual(buttons.count("pressed"), buttons.count("released"), libinput.output())

    def test_a_tap_is_a_key(self):
        device, evtest, libinput = self.use("[text]\npress_ms = 10000")
        libinput.wait_for(r"DEVICE_ADDED .*cap:k")
        while "(KEY_SPACE), value 1" not in evtest.output():  # it may not read fields yet
            for self.gel.contacts in ([(0.0, 0.0, (0.0, 0.0, 2.0))], []):
                time.sleep(0.5)
            evtest.read()
        libinput.wait_for("KEYBOARD_KEY .* released")
        self.stop(device, evtest, libinput)

    def test_zoom_is_a_mouse_with_a_key(self):
        device, evtest, libinput = self.use("[zoom]")
        libinput.wait_for(r"DEVICE_ADDED .*cap:kp")
        self.gel.contacts, self.gel.spread_Pa_m = [(0.0, 0.0, (0.0, 0.0, 2.0))], 1e6
        libinput.wait_for("KEYBOARD_KEY .* pressed")
        libinput.wait_for(r"POINTER_SCROLL_WHEEL .*vert -\d+")  # away from the user: nearer
        libinput.wait_for("KEYBOARD_KEY .* released")
        self.stop(device, evtest, libinput)

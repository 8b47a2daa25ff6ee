"""Reduced pictures of a running daemon, against the pictures that it was given, averaged by NumPy.
TRACTION_SEED=N repeats a run."""

import base64
import json
import os
import pathlib
import sys
import threading
import time
import unittest

import numpy as np
import zmq

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client" / "python"))
import rig  # noqa: E402
import seed  # noqa: E402
import traction  # noqa: E402

FORMATS = ([f"{colours}{how}" for colours in ("Mono", "BayerRG", "BayerGR", "BayerGB", "BayerBG")
            for how in ("8", "10", "10p", "10Packed", "12", "12p", "12Packed", "16")]
           + [f"{colours}{how}" for colours in ("RGB", "BGR") for how in ("8", "10", "10p", "12", "12p", "16")]
           + ["Mono14", "Mono14p", "YUV422_8", "YUV422_8_UYVY"])


def bits_of(name):
    return int("".join(c for c in name.removeprefix("YUV422_") if c.isdigit()))


def size_of(name, pixels):
    """Of a picture [bytes]."""
    bits = bits_of(name)
    samples = pixels * (3 if "GB" in name[:3] or "BGR" in name else 2 if "YUV" in name else 1)
    if name.endswith("Packed"):
        return samples * 3 // 2
    return samples * bits // 8 if name.endswith("p") else samples * (1 if bits == 8 else 2)


def samples_of(name, data):
    """The upper 8 bits of each, by the convention's words."""
    bits, data = bits_of(name), np.frombuffer(data, np.uint8)
    if name.endswith("Packed"):
        return data.reshape(-1, 3)[:, [0, 2]].ravel()
    if name.endswith("p"):
        each = np.unpackbits(data, bitorder="little").reshape(-1, bits)[:, -8:]
        return np.packbits(each, axis=1, bitorder="little").ravel()
    return data if bits == 8 else np.minimum(data.view("<u2") >> (bits - 8), 255).astype(np.uint8)


def plain(name, data, width, height):
    """(height, width, 3) or (height, width)."""
    samples = samples_of(name, data)
    if name.startswith("Mono"):
        return samples.reshape(height, width)
    if name.startswith(("RGB", "BGR")):
        return samples.reshape(height, width, 3)[:, :, ::1 if name[0] == "R" else -1]
    if name.startswith("YUV"):
        pairs = samples.reshape(height, width // 2, 4).astype(float)
        first = 1 if name.endswith("UYVY") else 0
        y = pairs[:, :, [first, first + 2]].reshape(height, width)
        u, v = (np.repeat(pairs[:, :, i + 1 - first], 2, axis=1) - 128 for i in (0, 2))
        colours = np.stack([y + 1.402 * v, y - 0.344136 * u - 0.714136 * v, y + 1.772 * u], axis=2)
        return np.clip(colours, 0, 255).astype(np.uint8)
    cells = samples.reshape(height // 2, 2, width // 2, 2).transpose(0, 2, 1, 3).reshape(height // 2, width // 2, 4)
    letters = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}[name[5:7]]
    green = [i for i in range(4) if letters[i] == "G"]
    colours = np.stack([cells[:, :, letters.index("R")], cells[:, :, green].astype(int).sum(axis=2) // 2,
                        cells[:, :, letters.index("B")]], axis=2)
    return colours.repeat(2, axis=0).repeat(2, axis=1)


def averaged(picture, factor):
    """Over whole squares of `factor`, rounded."""
    height, width = (side // factor * factor for side in picture.shape[:2])
    blocks = picture[:height, :width].reshape(height // factor, factor, width // factor, factor, -1)
    mean = (blocks.astype(int).sum(axis=(1, 3)) + factor**2 // 2) // factor**2
    return mean[:, :, 0] if picture.ndim == 2 else mean


def gel_of(name, width, height):
    """A gel file with a camera of this size, and few nodes; of a grey picture with one layer of markers."""
    if name.startswith("Mono"):
        return (f"format = 1\n[[layers]]\ncolour = \"grey\"\ncontrast = \"darker\"\ndepth_mm = 8\n[nodes]\ncolumns = 6\nrows = 6\npitch_mm = 12\n"
                f"[camera]\nwidth_px = {width}\nheight_px = {height}\n"
                f"principal_px = [{width / 2 - 0.5}, {height / 2 - 0.5}]\n")
    gel = (rig.SOURCE / "config/gels/paper.toml").read_text()
    lines, section = [], ""
    new = {"camera": {"width_px": width, "height_px": height, "principal_px": [width / 2 - 0.5, height / 2 - 0.5]},
           "nodes": {"columns": 6, "rows": 6, "pitch_mm": 12}}
    for line in gel.splitlines():
        section = line.strip("[] ").split("]")[0] if line.startswith("[") else section
        name = line.split(" = ")[0]
        lines.append(f"{name} = {new[section][name]}" if name in new.get(section, {}) else line)
    return "\n".join(lines)


class Feeder(threading.Thread):
    """Writes pictures into a pipe, one after another, some each second, until it is told to stop."""

    def __init__(self, pipe, pictures, rate):
        super().__init__(daemon=True)
        self.pipe, self.pictures, self.rate, self.over = pipe, pictures, rate, False

    def run(self):
        with open(self.pipe, "wb", buffering=0) as pipe:
            try:
                for number in range(10**6):
                    left = memoryview(self.pictures[number % len(self.pictures)])
                    while left:
                        left = left[pipe.write(left):]
                    time.sleep(1 / self.rate)
                    if self.over:
                        return
            except BrokenPipeError:
                pass


class Preview(unittest.TestCase):
    def setUp(self):
        self.chance = seed.chance(self.id())

    def test_it_is_the_average_of_the_picture_in_every_format(self):
        chance = self.chance
        for name in chance.sample(FORMATS, 4) + [chance.choice(["Mono8", "RGB8", "BayerRG8"])]:
            with self.subTest(name), rig.Rig() as bench:
                width, height = (chance.randrange(low, high) // 8 * 8 for low, high in ((400, 900), (300, 700)))
                widest = chance.choice([320, chance.randrange(16, 1025)])
                gel = bench.folder / "gel.toml"
                gel.write_text(gel_of(name, width, height))
                pipe = bench.folder / "pictures"
                os.mkfifo(pipe)
                pictures = [chance.randbytes(size_of(name, width * height)) for _ in range(7)]
                feeder = Feeder(pipe, pictures, 50)
                feeder.start()
                daemon = bench.daemon(
                    f'[camera]\npixel_format = "{name}"\nwidth_px = {width}\nheight_px = {height}\n'
                    f'[sensor]\ngel_file = "{gel}"\n[solve]\nmodel = "half-space"\n'
                    f"[publish]\npreview_hz = 20\npreview_width_px = {widest}\n", "--images", pipe, camera=None)
                seen = bench.subscribe(daemon, "traction/v1/default/preview/").collect(8, "preview", 30)
                feeder.over = True
                for one in seen:
                    factor = -(-width // widest)
                    given = plain(name, pictures[(one.header.camera_frame_id - 1) % len(pictures)], width, height)
                    expected = averaged(given, min(factor, height))
                    self.assertEqual(one.format, 1 if given.ndim == 2 else 2)
                    self.assertEqual((one.height, one.width), expected.shape[:2])
                    found = np.frombuffer(one.pixels, np.uint8).reshape(expected.shape)
                    self.assertEqual(np.abs(found - expected).max(), 0)
                    self.assertEqual(one.scale, factor)
                    self.assertEqual((one.origin_px.x, one.origin_px.y), ((factor - 1) / 2,) * 2)
                    self.assertLessEqual(one.width, widest)
                numbers = [one.header.camera_frame_id for one in seen]
                self.assertEqual(numbers, sorted(set(numbers)))
                self.assertEqual([one.header.sequence for one in seen], list(range(1, 9)))
                print(f"{name} {width}x{height}/{factor}", end=" ", flush=True)

    def test_it_comes_while_somebody_wants_it_and_fields_go_on(self):
        with rig.Rig() as bench:
            bench.twin("idle", truth=False)
            daemon = bench.daemon()
            everything = bench.subscribe(daemon)
            everything.collect(1)
            kinds = [everything.receive()[0] for _ in range(150)]
            self.assertNotIn("preview", kinds)

            stream = ["--connect", daemon.endpoint["stream"]]
            code, text = bench.ctl("echo", "--topic", "preview", "--count", "3", *stream)
            self.assertEqual(code, 0, text)
            for line in map(json.loads, text.splitlines()):
                self.assertEqual((line["width"], line["height"], line["format"], line["scale"]), (320, 240, "rgb8", 2))
                self.assertEqual(len(base64.b64decode(line["pixels"])), 320 * 240 * 3)
            with traction.Subscriber(endpoint=daemon.endpoint["stream"], timeout=30,
                                     topics=traction.Topics.PREVIEW | traction.Topics.FIELD) as both:
                wanted, fields = [], 0
                for message in both:
                    if isinstance(message, traction.Preview):
                        wanted.append(message)
                    else:
                        fields += 1
                    if len(wanted) == 10:
                        break
            self.assertEqual(wanted[0].pixels.shape, (240, 320, 3))
            self.assertEqual(len(wanted[0].header.zero), 16)
            self.assertGreater(fields, 10)
            intervals = np.diff([one.header.received_ns for one in wanted]) * 1e-9
            print(f"every {np.median(intervals):.3f} s", end=" ", flush=True)

            # When they are gone, it ends.
            deadline = time.monotonic() + 30 * rig.PATIENCE
            count = 0
            while count < 150:  # messages running
                self.assertLess(time.monotonic(), deadline)
                count = 0 if everything.receive()[0] == "preview" else count + 1
            self.assertEqual(daemon.stop(), 0, daemon.output())

    def test_through_a_gateway_it_comes_to_who_may_control(self):
        with rig.Rig() as bench:
            bench.twin("idle", truth=False)
            daemon = bench.daemon()
            reader, ada = zmq.curve_keypair(), zmq.curve_keypair()
            bench.allow("reader", reader[0].decode())
            server = bench.allow("ada", ada[0].decode(), "--control")
            keys = {name: (server, pair[0].decode(), pair[1].decode()) for name, pair in (("reader", reader), ("ada", ada))}
            gateway = bench.gateway(daemon, 'preview = ["tcp://127.0.0.1:*"]\n')
            everything = {name: bench.subscribe(gateway, "", keys[name]) for name in keys}
            named = {name: bench.subscribe(gateway, "traction/v1/default/preview/", keys[name]) for name in keys}
            for one in everything.values():
                one.collect(10)
            refused = rig.Subscriber(bench, gateway.endpoint["preview"], "", keys["reader"])
            gateway.wait_for('"reader" may only read')
            looker = rig.Subscriber(bench, gateway.endpoint["preview"], "", keys["ada"])
            seen = looker.collect(10, "preview", 30)
            self.assertEqual({one.width for one in seen}, {320})
            for name in keys:  # all that has come in the meantime, and more
                kinds = {everything[name].receive()[0] for _ in range(200)}
                self.assertNotIn("preview", kinds)
                self.assertIsNone(named[name].receive(0))
            self.assertIsNone(refused.receive(0))

            # When nobody looks any more, none are made.
            looker.socket.close(0)
            witness = bench.subscribe(daemon)
            deadline = time.monotonic() + 30 * rig.PATIENCE
            count = 0
            while count < 150:  # messages running
                self.assertLess(time.monotonic(), deadline)
                count = 0 if witness.receive()[0] == "preview" else count + 1
            again = rig.Subscriber(bench, gateway.endpoint["preview"], "traction/v1/", keys["ada"])
            again.collect(1, "preview", 30)


if __name__ == "__main__":
    unittest.main()

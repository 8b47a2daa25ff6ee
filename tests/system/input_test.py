"""Bad input to every program: one clear line, the right exit code, nothing left behind."""

import os
import re
import socket

import rig

USAGE, DATA, NO_INPUT, UNAVAILABLE, TEMPORARY, CONFIG = 64, 65, 66, 69, 75, 78


class Input(rig.TestCase):
    def refused(self, code, words, process):
        """Ends by itself with the code and one line of error, behind what was logged, that has all the words."""
        self.assertEqual(process.join(), code, process.output())
        *logged, line = process.lines
        self.assertTrue(all(re.match("tractiond: (camera|warning:|a gel not seen before:) ", other) for other in logged), process.output())
        for word in words:
            self.assertIn(word, line)

    def daemon(self, code, words, config="", camera=None):
        process = self.bench.daemon(config, camera=camera, ready=False)
        self.refused(code, words, process)
        left = [path.name for path in (self.bench.folder / "default" / "run").glob("*")]
        self.assertEqual(left, [])

    def test_wrong_configurations_and_gel_files(self):
        newer = (rig.SOURCE / "config/gels/paper.toml").read_text().replace("format = 1", "format = 2")
        for code, words, config in (
                (CONFIG, ["tractiond.toml:2", "pakcet_timeout_us", "packet_timeout_us"], "[camera]\npakcet_timeout_us = 3\n"),
                (CONFIG, ["tractiond.toml:1"], "[camera\n"),
                (NO_INPUT, ["nowhere.toml"], '[sensor]\ngel_file = "nowhere.toml"\n'),
                (CONFIG, ["gel.toml", "format"], f'[sensor]\ngel_file = "{self.file("gel.toml", newer)}"\n'),
                (UNAVAILABLE, ["camera"], "[camera]\nwait = false\n")):
            with self.subTest(config):
                self.daemon(code, words, config)

    def test_wrong_command_lines(self):
        for program, code, words, *arguments in (
                ("tractiond", NO_INPUT, ["nowhere.toml"], "--config", "nowhere.toml"),
                ("tractiond", USAGE, ["--colour"], "--colour"),
                ("tractiond", USAGE, ["a/b"], "--instance", "a/b"),
                ("traction-twin", NO_INPUT, ["no-such"], "no-such"),
                ("traction-twin", CONFIG, ["bad.toml:2", "perid_s", "period_s"], self.file("bad.toml", "format = 1\nperid_s = 1\n")),
                ("traction-twin", UNAVAILABLE, ["10.1.2.3"], "idle", "--cache", rig.cache_directory(), "--address", "10.1.2.3"),
                ("traction-twin", DATA, ["odd.raw"], "idle", "--serve", self.file("odd.raw", "x" * 1000)),
                ("traction-twin", 73, ["/nowhere/pictures"], "idle", "--cache", rig.cache_directory(), "--images", "/nowhere/pictures"),
                ("traction-twin", USAGE, ["--lost-ratio", "--images"], "idle", "--images", "-", "--lost-ratio", "0.1")):
            with self.subTest(arguments):
                self.refused(code, words, self.bench.start(rig.BIN / program, *arguments))

    # --- what the daemon meets

    def test_camera_held_by_another_client(self):
        self.bench.twin("idle")
        holder = self.bench.daemon(instance="holder")
        self.bench.subscribe(holder).collect(1)
        self.daemon(TEMPORARY, ["another"], '[camera]\nid = "127.0.0.1"\n')
        self.assertEqual(holder.stop(), 0, holder.output())

    def test_unknown_feature_of_the_camera(self):
        self.bench.twin("idle")
        self.daemon(CONFIG, ["Brightness"], '[camera]\nid = "127.0.0.1"\nfeatures = [{ Brightness = 3 }]\n')

    def test_port_in_use(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            endpoint = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
            self.daemon(UNAVAILABLE, [endpoint], f'[publish]\nstream = ["{endpoint}"]\n')

    def test_damaged_zero_is_named_and_not_replaced(self):
        self.bench.twin("idle")
        first = self.bench.daemon()
        self.bench.subscribe(first).collect(1)
        self.assertEqual(first.stop(), 0, first.output())
        [pose] = [path for path in first.state.iterdir() if "rest" in path.name or "zero" in path.name]
        whole = pose.read_bytes()
        pose.write_bytes(whole[:len(whole) // 2])
        self.daemon(DATA, [pose.name, "delete"], '[camera]\nid = "127.0.0.1"\n')
        self.assertEqual(pose.read_bytes(), whole[:len(whole) // 2])

    # --- the twin

    def test_twin_address_in_use(self):
        self.bench.twin("idle")
        self.refused(UNAVAILABLE, ["127.0.0.1"], self.bench.start(rig.BIN / "traction-twin", "idle", "--cache", rig.cache_directory()))

    def test_twin_pictures_that_nobody_reads(self):
        pipe = self.bench.folder / "pictures"
        os.mkfifo(pipe)
        for reader in (False, True):
            twin = self.bench.start(rig.BIN / "traction-twin", "idle", "--cache", rig.cache_directory(), "--images", pipe,
                                    "--truth", self.bench.folder / "truth")
            if reader:  # and stops reading: the twin waits with a part of a picture
                with open(pipe, "rb", buffering=0) as source:
                    source.read(1)
                    self.assertEqual(twin.stop(), 0, twin.output())
            else:
                while not (self.bench.folder / "truth").exists():
                    twin.read(0.01)
                self.assertEqual(twin.stop(), 0, twin.output())

    def test_twin_whose_reader_goes(self):
        pipe = self.bench.folder / "pictures"
        os.mkfifo(pipe)
        twin = self.bench.start(rig.BIN / "traction-twin", "idle", "--cache", rig.cache_directory(), "--images", pipe)
        with open(pipe, "rb", buffering=0) as source:
            source.read(1)
        self.refused(74, [str(pipe), "Broken pipe"], twin)

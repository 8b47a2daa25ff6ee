"""Bad input to every program: one clear line, the right exit code, nothing left behind."""

import os
import re
import socket
import unittest

import rig

USAGE, DATA, NO_INPUT, UNAVAILABLE, TEMPORARY, CONFIG = 64, 65, 66, 69, 75, 78


class Input(unittest.TestCase):
    def setUp(self):
        self.bench = self.enterContext(rig.Rig())

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

    def file(self, name, text):
        path = self.bench.folder / name
        path.write_text(text)
        return path

    # --- the daemon's configuration

    def test_unknown_key_names_the_nearest(self):
        self.daemon(CONFIG, ["tractiond.toml:2", "pakcet_timeout_us", "packet_timeout_us"],
                    "[camera]\npakcet_timeout_us = 3\n")

    def test_keys_of_earlier_versions(self):
        self.daemon(CONFIG, ["tractiond.toml:2", "solve.solver", "regularisation", "delete"],
                    '[solve]\nsolver = "contact-step"\nregularisation = 0.001\n')

    def test_wrong_type(self):
        self.daemon(CONFIG, ["tractiond.toml:2", "camera.wait"], '[camera]\nwait = "yes"\n')

    def test_out_of_range(self):
        self.daemon(CONFIG, ["tractiond.toml:2", "noise_px"], "[solve]\nnoise_px = -1.0\n")

    def test_no_toml(self):
        self.daemon(CONFIG, ["tractiond.toml:1"], "[camera\n")

    def test_missing_configuration(self):
        self.refused(NO_INPUT, ["nowhere.toml"], self.bench.start(rig.BIN / "tractiond", "--config", "nowhere.toml"))

    def test_a_folder_for_a_configuration(self):
        self.refused(NO_INPUT, [str(self.bench.folder)],
                     self.bench.start(rig.BIN / "tractiond", "--config", self.bench.folder))

    def test_unknown_option(self):
        self.refused(USAGE, ["--colour"], self.bench.start(rig.BIN / "tractiond", "--colour"))

    def test_impossible_instance_name(self):
        self.refused(USAGE, ["a/b"], self.bench.start(rig.BIN / "tractiond", "--instance", "a/b"))

    # --- the gel file

    def test_missing_gel_file(self):
        self.daemon(NO_INPUT, ["nowhere.toml"], '[sensor]\ngel_file = "nowhere.toml"\n')

    def test_gel_file_of_a_newer_version(self):
        text = (rig.SOURCE / "config/gels/paper.toml").read_text().replace("format = 1", "format = 2")
        self.daemon(CONFIG, ["gel.toml", "format"], f'[sensor]\ngel_file = "{self.file("gel.toml", text)}"\n')

    def test_impossible_gel(self):
        text = (rig.SOURCE / "config/gels/paper.toml").read_text().replace("0.49", "0.5")
        self.daemon(CONFIG, ["gel.toml", "poisson"], f'[sensor]\ngel_file = "{self.file("gel.toml", text)}"\n')

    # --- what the daemon meets

    def test_no_camera_and_not_to_wait(self):
        self.daemon(UNAVAILABLE, ["camera"], '[camera]\nwait = false\n')

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

    def twin(self, code, words, *arguments):
        self.refused(code, words, self.bench.start(rig.BIN / "traction-twin", *arguments))

    def test_twin_unknown_scenario(self):
        self.twin(NO_INPUT, ["no-such"], "no-such")

    def test_twin_unknown_key(self):
        self.twin(CONFIG, ["bad.toml:2", "perid_s", "period_s"], self.file("bad.toml", "format = 1\nperid_s = 1\n"))

    def test_twin_address_in_use(self):
        self.bench.twin("idle")
        self.twin(UNAVAILABLE, ["127.0.0.1"], "idle", "--cache", rig.cache_directory())

    def test_twin_foreign_address(self):
        self.twin(UNAVAILABLE, ["10.1.2.3"], "idle", "--cache", rig.cache_directory(), "--address", "10.1.2.3")

    def test_twin_images_of_a_wrong_size(self):
        self.twin(DATA, ["odd.raw"], "idle", "--serve", self.file("odd.raw", "x" * 1000))

    def test_twin_truth_that_cannot_be_written(self):
        self.twin(73, ["/nowhere/truth"], "idle", "--cache", rig.cache_directory(), "--truth", "/nowhere/truth")

    def test_twin_pictures_that_cannot_be_written(self):
        self.twin(73, ["/nowhere/pictures"], "idle", "--cache", rig.cache_directory(), "--images", "/nowhere/pictures")
        self.twin(USAGE, ["--lost-ratio", "--images"], "idle", "--images", "-", "--lost-ratio", "0.1")

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

    # --- the client

    def ctl(self, code, words, *arguments, env=None):
        self.refused(code, words, self.bench.start(rig.BIN / "tractionctl", *arguments, env=env))

    def test_ctl_without_a_daemon(self):
        environment = {"XDG_RUNTIME_DIR": str(self.bench.folder)}
        for command in ("status", "zero"):
            self.ctl(UNAVAILABLE, [], command, env=environment)

    def test_ctl_unknown_command(self):
        self.ctl(USAGE, ["dance"], "dance")

    def test_ctl_bad_endpoint(self):
        self.ctl(USAGE, ["carrier-pigeon"], "echo", "--connect", "carrier-pigeon://home")

    def test_ctl_unknown_topic(self):
        self.ctl(USAGE, ["weather"], "echo", "--topic", "weather")


if __name__ == "__main__":
    os.umask(0o077)
    unittest.main()

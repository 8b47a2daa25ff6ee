"""What systemd sees of the daemon: ready, watchdog, stopping; and that nothing is left in its runtime directory."""

import contextlib
import os
import re
import signal
import subprocess
import time

from prometheus_client import parser

import rig
import suite


class Service(rig.TestCase):
    def setUp(self):
        super().setUp()
        self.systemd = rig.Systemd(self.bench)

    def check(self, daemon):
        self.assertTrue(any(line.startswith("STATUS=") for line in self.systemd.wait_for("READY=1")))
        self.systemd.wait_for("WATCHDOG=1")
        self.systemd.wait_for("WATCHDOG=1")
        self.assertEqual(daemon.stop(), 0, daemon.output())
        self.systemd.wait_for("STOPPING=1")
        self.assertEqual(os.listdir(self.bench.folder / "default" / "run"), [])

    def test_with_a_camera(self):
        self.bench.twin("idle")
        daemon = self.bench.daemon(env=self.systemd.env)
        self.bench.subscribe(daemon).collect(10)
        self.check(daemon)

    def test_while_it_waits_for_a_camera(self):
        daemon = self.bench.daemon(env=self.systemd.env)
        daemon.wait_for("waiting for a camera")
        self.check(daemon)

    def test_stops_while_factors_are_computed(self):
        gel = (rig.SOURCE / "config/gels/paper.toml").read_text()
        path = self.bench.folder / "new.toml"
        path.write_text(re.sub(r"(?m)^youngs_modulus_pa.*", f"youngs_modulus_pa = {self.draw.uniform(1e5, 3e5)}", gel))
        daemon = self.bench.daemon(f'[sensor]\ngel_file = "{path}"\n', env=self.systemd.env, ready=False)
        daemon.wait_for("computing its factors")
        self.assertEqual(daemon.stop(), 0, daemon.output())
        self.assertIn("stopped before it ran", daemon.output())
        self.assertNotIn("step 5 of 5", daemon.output())
        self.assertEqual(os.listdir(self.bench.folder / "default" / "run"), [])

    def test_stops_while_another_holds_the_camera(self):
        self.bench.twin("idle")
        self.bench.subscribe(self.bench.daemon()).collect(1)
        recording = self.bench.folder / "second.mcap"
        second = self.bench.daemon("", "--record", recording, instance="second", env=self.systemd.env, ready=False)
        second.wait_for("is held by another client")
        begin = time.monotonic()
        self.assertEqual(second.stop(), 0, second.output())
        self.assertIn("stopped before it ran", second.output())  # else it would have waited for ten seconds
        self.assertFalse(recording.exists(), "an empty recording keeps the next start from recording")
        print(f"\n  stopped in {time.monotonic() - begin:.2f} s")

    def test_takes_all_that_is_new_in_its_configuration_or_nothing(self):
        self.bench.twin("idle")
        daemon = self.bench.daemon("frame_rate_hz = 60\n", env=self.systemd.env)
        subscriber = self.bench.subscribe(daemon)
        subscriber.collect(10)
        file = self.bench.folder / "default" / "tractiond.toml"
        first = file.read_text()

        def reload(text, answer):
            file.write_text(text)
            daemon.child.send_signal(signal.SIGHUP)
            self.systemd.wait_for("RELOADING=1")
            self.systemd.wait_for("READY=1")
            daemon.wait_for(answer)

        rate = self.draw.randint(20, 45)
        for wrong, answer in ((first + "gain = \n", "stays as it was: .*tractiond.toml:4: "),
                              (first.replace("60", "0.5e9"), "stays as it was: .*frame_rate_hz"),
                              (first.replace("60", "50") + "width_px = 320\n[publish]\nhigh_water_mark = 7\n",
                               "not while it runs: camera.width_px, publish.high_water_mark; restart the service"),
                              (first + '[sensor]\ngel_file = "/nowhere.toml"\n', "stays as it was: /nowhere.toml"),
                              (first, "nothing in the configuration has changed")):
            reload(wrong, answer)
        reload(first.replace("60", str(rate)), f"new in the configuration: camera.frame_rate_hz = {rate} [(]was 60[)]")
        daemon.wait_for(f"{rate}(\\.0)? frames/s")
        self.assertTrue(subscriber.collect(10)[-1].valid)
        reload(first.replace("60", "50") + "features = [{ NoSuchFeature = 1 }]\n", "is opened as before: .*NoSuchFeature")
        self.assertTrue(subscriber.collect(10)[-1].valid)
        self.assertEqual(daemon.stop(), 0, daemon.output())
        self.assertNotIn("no zero is kept", daemon.output().split("nothing in the configuration")[1])

    def test_of_a_refused_reload_nothing_stays_in_the_camera(self):
        draw = self.draw
        self.bench.twin("idle")
        # On a busy machine the twin may not answer within the 130 ms of a liveness check: the camera would be given up.
        daemon = self.bench.daemon("frame_rate_hz = 60\nsilence_timeout_ms = 0\n")
        subscriber = self.bench.subscribe(daemon)
        subscriber.collect(5)
        file = self.bench.folder / "default" / "tractiond.toml"
        first = file.read_text()
        look = ("--control", daemon.endpoint["control"], "camera", "list")
        before = self.bench.ctl(*look)
        self.assertEqual(before[0], 0, before)
        for _ in range(2):
            features = [f"{{ BinningHorizontal = {draw.randint(2, 16)} }}", f"{{ TestRegister = {draw.randrange(2**31)} }}",
                        f"{{ BinningVertical = {draw.randint(2, 16)} }}", '{ TriggerSelector = "AcquisitionStart" }']
            features = draw.sample(features, draw.randint(1, len(features)))
            text = draw.choice(("exposure_us = 777\n", "frame_rate_hz = 31\n", ""))
            refused = draw.choice(('strobe_line = "Line1"\n', "throughput_bytes_per_s = 1000000\n", "features"))
            if refused == "features":
                features.append("{ NoSuchFeature = 1 }")
            else:
                text += refused + draw.choice(('trigger = "software"\n', ""))
            text += f"features = [{', '.join(features)}]\n"
            file.write_text(first.replace("frame_rate_hz = 60\n", text))
            daemon.lines.clear()
            daemon.child.send_signal(signal.SIGHUP)
            daemon.wait_for("is opened as before")
            daemon.wait_for("frames/s, packets of")
            subscriber.collect(5)
            self.assertEqual(self.bench.ctl(*look), before, file.read_text())
        self.assertEqual(daemon.stop(), 0, daemon.output())

    @suite.realtime
    def test_metrics_as_prometheus_reads_them(self):
        self.bench.twin("idle")
        daemon = self.bench.daemon()
        subscriber = self.bench.subscribe(daemon)
        subscriber.collect(130)  # the status is up to a second old
        code, text = self.bench.ctl("metrics", "--control", daemon.endpoint["control"])
        self.assertEqual(code, 0, text)
        families = {family.name: family for family in parser.text_string_to_metric_families(text)}

        def value(family, name="", **labels):
            found = [sample.value for sample in families["traction_" + family].samples
                     if sample.name.endswith(name) and labels.items() <= sample.labels.items()]
            self.assertEqual(len(found), 1, (family, labels))
            return found[0]

        self.assertEqual(value("up"), 1)
        self.assertEqual(value("camera_state", state="streaming"), 1)
        self.assertEqual(value("camera_state", state="lost"), 0)
        lost = sum(sample.value for sample in families["traction_frames_lost"].samples)
        self.assertEqual(value("frames_received"), value("frames_published") + value("frames_in_flight") + lost)
        self.assertGreaterEqual(value("frames_published"), 25)
        self.assertEqual(value("markers_found", layer="1"), 576)
        self.assertGreater(value("memory_bytes"), 20e6)
        self.assertGreater(value("residual_pixels"), 0)
        for stage in ("track", "solve", "send", "total"):
            count = value("latency_seconds", "_count", stage=stage)
            self.assertEqual(count, value("latency_seconds", "_bucket", stage=stage, le="+Inf"))
            buckets = [sample.value for sample in families["traction_latency_seconds"].samples
                       if sample.name.endswith("_bucket") and sample.labels["stage"] == stage]
            self.assertEqual(buckets, sorted(buckets))
            self.assertIn(count - value("frames_published"), (0, 1))  # one is counted there when it has been sent
            self.assertLess(value("latency_seconds", "_sum", stage=stage), 1.0 * count)

        # As systemd's socket hands it over, whatever is asked.
        for request in (b"GET /metrics HTTP/1.1\r\nHost: box\r\n\r\n", b"", self.draw.randbytes(100_000)):
            answer = subprocess.run([rig.BIN / "tractionctl", "metrics", "--http", "--control", daemon.endpoint["control"]],
                                    input=request, stdout=subprocess.PIPE, timeout=60, check=True).stdout
            head, _, body = answer.partition(b"\r\n\r\n")
            self.assertRegex(head.decode(), r"\AHTTP/1.0 200 OK\r\nContent-Type: text/plain; version=0.0.4")
            self.assertIn(f"Content-Length: {len(body)}", head.decode())
            self.assertTrue(list(parser.text_string_to_metric_families(body.decode())))
        self.assertEqual(daemon.stop(), 0, daemon.output())
        code, text = self.bench.ctl("metrics", "--control", daemon.endpoint["control"])
        self.assertEqual((code, text.splitlines()[-1]), (0, 'traction_up{instance="default"} 0'))

    def test_the_journal_is_told_what_is_a_warning(self):
        reader, writer = os.pipe()
        stat = os.fstat(writer)
        env = {**self.systemd.env, "JOURNAL_STREAM": f"{stat.st_dev}:{stat.st_ino}"}
        self.bench.twin("idle", "--rate", "30")
        daemon = self.bench.daemon(env=env, ready=False, stderr=writer)
        self.systemd.wait_for("READY=1")
        self.bench.subscribe(daemon).collect(1)
        self.assertEqual(daemon.stop(), 0)
        wrong = self.bench.daemon("frame_rte_hz = 1\n", env=env, ready=False, stderr=writer)
        self.assertEqual(wrong.join(), 78)
        os.close(writer)
        with os.fdopen(reader) as log:
            lines = log.read().splitlines()
        for line in lines:
            self.assertRegex(line, r"^<[3467]>(?!tractiond)")
        self.assertTrue([line for line in lines if line.startswith("<6>running")], lines)
        self.assertRegex(lines[-1], "^<3>.*frame_rte_hz")
        for line in lines:
            self.assertEqual(line.startswith("<4>"), "warning: " in line, line)

    def test_with_a_log_that_nobody_reads(self):
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        with contextlib.suppress(BlockingIOError):
            while os.write(writer, 4096 * b"."):
                pass
        os.set_blocking(writer, True)
        self.bench.twin("idle")
        daemon = self.bench.daemon(env=self.systemd.env, ready=False, stderr=writer)
        os.close(writer)
        self.systemd.wait_for("READY=1")
        self.bench.subscribe(daemon).collect(60)  # its status is a second old at most
        code, output = self.bench.ctl("--control", daemon.endpoint["control"], "status")
        self.assertEqual(code, 0, output)
        self.assertEqual(daemon.stop(), 0)
        self.systemd.wait_for("STOPPING=1")
        os.close(reader)

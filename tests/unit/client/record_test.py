"""tractionctl record, info, recover, export: what is published is in the file, and what is wrong with a file is said."""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "client/python"))
import traction  # noqa: E402
from ctl import OUTPUT, PROGRAM, USAGE, Case, ctl  # noqa: E402
from deadline import HUNG_S  # noqa: E402

DATA, NO_INPUT, UNAVAILABLE, CANNOT_CREATE = 65, 66, 69, 73
from traction.intake import Intake, Mode, Topics  # noqa: E402
from traction.wire import message  # noqa: E402


class Record(Case):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))

    def record(self, name="a.mcap", size=300_000, ending=signal.SIGINT, **options):
        """Records until the file has that size."""
        path = self.folder / name
        child = self.start("record", path, *self.publisher(**options), stdout=subprocess.PIPE)
        while not path.exists() or path.stat().st_size < size:
            time.sleep(0.01)
        child.send_signal(ending)
        out, err = child.communicate(timeout=HUNG_S)
        self.assertEqual((child.returncode, err), (0, ""))
        self.assertRegex(out, rf"\A{path}: \d+ messages of \d+\.\d s, .* 0 lost\n\Z")
        return path

    def info(self, path, code=0):
        returned, out, err = ctl("info", path, "--json")
        self.assertEqual(returned, code, err)
        return json.loads(out)

    def test_all_that_is_published_is_in_the_file(self):
        path = self.record()
        info = self.info(path)
        self.assertEqual((info["closed"], info["indexed"], info["trouble"], info["bytes"]),
                         (True, True, "", path.stat().st_size))
        (topic,) = info["topics"]
        self.assertEqual((topic["topic"], topic["type"], topic["sensor"], topic["lost"], topic["restarts"]),
                         ("traction/v1/gel/field/", "traction.v1.Field", "gel", 0, 0))
        self.assertGreater(topic["messages"], 10)
        code, out, err = ctl("info", path)
        self.assertEqual((code, err), (0, ""))
        self.assertRegex(out, rf"traction/v1/gel/field/ +{topic['messages']} messages .* 0 lost")

    def test_contacts_of_traction_touch_are_recorded_and_drawn(self):
        path, drawn = self.record(contacts=True), self.folder / "drawn.mcap"
        topics = {topic["topic"]: topic for topic in self.info(path)["topics"]}
        self.assertEqual(topics.keys(), {"traction/v1/gel/field/", "traction/v1/gel/contacts/"})
        contacts = topics["traction/v1/gel/contacts/"]
        self.assertEqual((contacts["type"], contacts["lost"]), ("traction.v1.Contacts", 0))
        self.assertGreater(contacts["messages"], 10)
        self.assertEqual(ctl("export", path, drawn), (0, "", ""))
        scenes = {topic["topic"]: topic for topic in self.info(drawn)["topics"]}["foxglove/gel/scene"]
        self.assertEqual(scenes["messages"], contacts["messages"])  # without a description nodes are not drawn
        self.assertEqual(drawn.read_bytes().count(b"4711: stick ratio unknown"), contacts["messages"])

    def test_exported_contacts_are_those_that_traction_touch_makes_of_the_fields(self):
        path, file = self.record(contacts=True), self.folder / "touch.csv"
        messages = {topic["type"]: topic["messages"] for topic in self.info(path)["topics"]}
        self.assertEqual(ctl("export", path, file, "--contacts"), (0, "", ""))
        table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding=None)
        self.assertEqual(len(table), messages["traction.v1.Field"] + 1)
        self.assertEqual([*table["phase"]], ["begin", *["move"] * (len(table) - 2), "end"])
        self.assertEqual({*table["id"]}, {1})
        self.assertTrue((table["force_z_N"][:-1] == 3.5).all() and (table["moment_z_Nm"][:-1] == 0.25).all())
        self.assertEqual((table["force_z_N"][-1], table["moment_z_Nm"][-1], table["orientation_rad"][-1]), (0, 0, 0.5))
        self.assertTrue(file.read_text().splitlines()[1].endswith(",,,,,,,,,,,none"), "slip is not known")
        self.assertEqual(table["end_cause"][-1], "stopped")  # the recording ends
        self.assertEqual(ctl("export", path, self.folder / "touch.mcap", "--contacts")[0], USAGE)
        self.assertEqual(ctl("export", path, file, "--contacts", "--sensor", "other")[0], DATA)

    def test_exported_numbers_are_the_messages(self):
        path = self.record()
        messages = self.info(path)["topics"][0]["messages"]
        recorded = [*traction.recording(path)]
        self.assertEqual(len(recorded), messages)
        for one in recorded:
            self.assertEqual(one.message.force_N.shape, (576, 3))
            self.assertTrue(one.message.valid and one.message.node_valid.all())
            self.assertEqual([*one.message.resultant_N], [1.5, -2.5, 3.5])
        sequence = [one.message.header.sequence for one in recorded]
        self.assertTrue((np.diff(sequence) == 1).all())
        log_ns = [one.log_time_ns for one in recorded]
        self.assertTrue((np.diff(log_ns) > 0).all())
        self.assertLess(abs(log_ns[-1] * 1e-9 - time.time()), 3600)

        self.assertEqual(ctl("export", path, self.folder / "a.csv"), (0, "", ""))
        table = np.genfromtxt(self.folder / "a.csv", delimiter=",", names=True, dtype=None, encoding=None)
        self.assertEqual(([*table["sequence"]], [*table["log_time_ns"]]), (sequence, log_ns))
        self.assertTrue((table["force_y_N"] == -2.5).all())
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["a.csv", "a.mcap"])

    def test_a_recorder_that_is_killed_leaves_what_can_be_recovered(self):
        path = self.folder / "a.mcap"
        child = self.start("record", path, *self.publisher(), stdout=subprocess.DEVNULL)
        while not path.exists() or path.stat().st_size < 200_000:
            time.sleep(0.01)
        child.send_signal(signal.SIGKILL)
        child.wait()
        info = self.info(path, DATA)
        self.assertFalse(info["closed"])
        self.assertRegex(info["trouble"], "was not closed")
        whole = self.folder / "whole.mcap"
        code, out, err = ctl("recover", path, whole)
        self.assertEqual((code, err), (0, ""))
        again = self.info(whole)
        self.assertEqual([one["messages"] for one in again["topics"]], [one["messages"] for one in info["topics"]])
        self.assertGreater(again["topics"][0]["messages"], 10)

    def test_a_recording_ends_after_the_seconds_that_it_was_given(self):
        path = self.folder / "a.mcap"
        code, out, err = ctl("record", path, "--seconds", "0.3", *self.publisher())
        self.assertEqual((code, err), (0, ""))
        self.assertTrue(self.info(path)["closed"])

    def test_a_disk_that_fills_stops_the_recording_and_says_so(self):
        script = ('mount -t tmpfs -o size=1500k none . && cd "$PWD" && "$1" record a.mcap $2 $3; code=$?; '
                  '"$1" info a.mcap --json; exit $code')
        child = subprocess.run(["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script, "sh", PROGRAM,
                                *self.publisher()[:2]], cwd=self.folder, capture_output=True, text=True, timeout=HUNG_S)
        self.assertEqual(child.returncode, OUTPUT, child.stderr)
        self.assertRegex(child.stderr, r"\Atractionctl: a\.mcap: cannot be written: No space left on device; the "
                                       r"recording has stopped with \d+ messages of ")
        info = json.loads(child.stdout)
        messages = int(re.search(r"with (\d+) messages", child.stderr)[1])
        self.assertEqual(info["topics"][0]["messages"], messages)
        self.assertTrue(info["closed"])
        self.assertNotIn("without its end", child.stderr)
        self.assertGreater(messages, 5)

    def test_a_recording_that_was_cut_off_is_exported_as_far_as_it_goes(self):
        path = self.record()
        cut = self.folder / "cut.mcap"
        cut.write_bytes(path.read_bytes()[:path.stat().st_size * 2 // 3])
        self.fails(DATA, "it was not closed.*cut.csv has the \\d+ fields", "export", cut, self.folder / "cut.csv")
        fields = []
        with self.assertRaisesRegex(traction.Malformed, "was not closed"):
            for one in traction.recording(cut):
                fields.append(one)
        self.assertEqual(len(fields), len((self.folder / "cut.csv").read_text().splitlines()) - 1)
        self.assertGreater(len(fields), 5)

    def test_wrong_words_and_places_are_told(self):
        path = self.record(size=50_000)
        self.fails(USAGE, "neither with .csv nor with .mcap", "export", path, self.folder / "a.txt")
        self.fails(DATA, "is of another sensor: it has fields of gel, not of left", "export", path,
                   self.folder / "a.csv", "--sensor", "left")
        self.fails(CANNOT_CREATE, "is there already", "record", path, *self.publisher())
        self.fails(CANNOT_CREATE, "is there already", "recover", path, path)
        self.fails(CANNOT_CREATE, "No such file", "record", self.folder / "no" / "a", *self.publisher())
        self.fails(CANNOT_CREATE, "No such file", "export", path, self.folder / "no" / "a.csv")
        self.fails(UNAVAILABLE, "no publisher at", "record", self.folder / "b", "--connect", "ipc:///tmp/no-such-one")
        self.assertFalse((self.folder / "b").exists())
        self.assertTrue(self.info(path)["closed"])


if __name__ == "__main__":
    unittest.main()

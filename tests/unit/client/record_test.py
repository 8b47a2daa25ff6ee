"""tractionctl record, info, recover, export: what is published is in the file, and what is wrong with a file is said."""

import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
import seed

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "client/python"))
import hostile  # noqa: E402
import traction  # noqa: E402
from ctl import OUTPUT, PROGRAM, USAGE, Case, ctl  # noqa: E402
from deadline import HUNG_S  # noqa: E402
from traction.intake import Intake, Mode, Topics  # noqa: E402
from traction.wire import message  # noqa: E402

DATA, NO_INPUT, UNAVAILABLE, CANNOT_CREATE = 65, 66, 69, 73


BOOTS = b"A" * 16, b"B" * 16
TOPIC = b"traction/v1/gel/field/"


def fields(order):
    """Fields of two daemons with one sensor.name, 60 in a second; each sees one contact that is held, at a place of its own."""
    counts = [0, 0]
    for frame, which in enumerate(order):
        counts[which] += 1
        field = message("Field")(timestamp=1.0, valid=True)
        header = field.header
        header.sensor, header.boot, header.sequence = "gel", BOOTS[which], counts[which]
        header.frame_number = counts[which]
        header.captured_ns = 10**9 + frame * 16_666_667
        field.resultant_N.z = 1.0 + which
        contact = field.contacts.add(area_m2=3e-5)
        contact.position_m.x, contact.force_N.z = 0.02 * which, 1.0 + which
        contact.position_deviation_m.x = contact.position_deviation_m.y = 5e-5
        yield field.SerializeToString()


def write_recording(path, payloads):
    """A recording of them, 60 in a second."""
    def text(value):
        return struct.pack("<I", len(value)) + value

    def record(operation, content):
        return struct.pack("<BQ", operation, len(content)) + content

    schema = record(3, struct.pack("<H", 1) + text(b"traction.v1.Field") + text(b"") + text(b""))
    channel = record(4, struct.pack("<HH", 1, 1) + text(TOPIC) + text(b"protobuf") + text(b""))
    messages = b"".join(record(5, struct.pack("<HIQQ", 1, 0, 10**18 + at * 16_666_667, 10**18 + at * 16_666_667) + payload)
                        for at, payload in enumerate(payloads))
    magic = b"\x89MCAP0\r\n"
    path.write_bytes(magic + record(1, text(b"") + text(b"")) + schema + channel + messages + record(15, bytes(4)) +
                     record(2, bytes(20)) + magic)
    return path


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

    def rows(self, path, code, *options):
        """What export makes of a recording, and what it says."""
        file = self.folder / "rows.csv"
        returned, _, error = ctl("export", path, file, *options)
        self.assertEqual(returned, code, error)
        return np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding=None), error

    def test_of_two_daemons_with_one_name_the_first_is_read_and_the_second_named(self):
        said = "two sources are called 'gel' at once (boot or run 41414141... and 42424242...)"
        path = write_recording(self.folder / "two.mcap", fields([0, 1] * 20))
        table, error = self.rows(path, DATA)
        self.assertIn(said, error)
        self.assertEqual((len(table), {*table["force_z_N"]}), (20, {1.0}))
        table, error = self.rows(path, DATA, "--contacts")
        self.assertIn(said, error)
        phases = [*table["phase"]]
        print("  two daemons of one name in one recording, 20 fields each: a held contact begins "
              f"{phases.count('begin')} times, {len(table) - 1} rows; right: 1 time, 20 rows, and the second is named")
        self.assertEqual(phases, ["begin", *["move"] * 19, "end"])
        info = self.info(path)
        self.assertIn(said, info["second_source"])
        self.assertEqual((info["topics"][0]["messages"], info["topics"][0]["restarts"]), (20, 0))
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            boots = [one.message.header.boot for one in traction.recording(path)]
        self.assertEqual((boots, len(warned)), ([BOOTS[0]] * 20, 1))
        self.assertIn(said, str(warned[0].message))

        # Live, the first message of the second one is what a restart would be.
        replay = self.start("replay", path, "--bind", "tcp://127.0.0.1:*", stdout=subprocess.PIPE)
        endpoint = replay.stdout.readline().split()[-1]
        code, out, error = ctl("echo", "--connect", endpoint, "--count", "21")
        self.assertEqual(code, 0, error)
        self.assertEqual([json.loads(line)["resultant_N"][2] for line in out.splitlines()], [1, 2, *[1] * 19])
        self.assertEqual(error.count(said), 1, error)
        intake = Intake("", Mode.STREAM, Topics.ALL)
        taken = [intake.take([TOPIC, payload, b"1.0"]) for payload in fields([0, 1] * 20)]
        self.assertEqual([one.header.boot for one in taken if one], [BOOTS[0], BOOTS[1], *[BOOTS[0]] * 19])
        self.assertIn(said, intake.sources.trouble)

    def test_a_daemon_that_is_started_anew_is_no_second_one(self):
        path = write_recording(self.folder / "anew.mcap", fields([0] * 20 + [1] * 20))
        table, error = self.rows(path, 0)
        self.assertEqual((len(table), error), (40, ""))
        table, error = self.rows(path, 0, "--contacts")
        self.assertEqual([(row["id"], row["end_cause"]) for row in table if row["phase"] == "end"], [(1, "stopped"), (2, "stopped")])
        self.assertEqual(self.info(path)["second_source"], "")
        self.assertEqual(len([*traction.recording(path)]), 40)

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

    def test_whatever_is_damaged_python_says_malformed(self):
        """At any place by chance, and in the lengths, kinds and channels of records; TRACTION_DAMAGES: how many."""
        count, whole = int(os.environ.get("TRACTION_DAMAGES", 400)), self.folder / "whole.mcap"
        draw, path = seed.chance(self.id()), self.folder / "damaged.mcap"
        sources = [write_recording(whole, fields([0] * 20)).read_bytes(), self.record(size=60_000).read_bytes()]
        again = struct.pack("<HHI", 1, 1, 24) + b"traction/v1/gel/markers/" + struct.pack("<I", 8) + b"protobuf" + bytes(4)
        told, silent = 0, 0
        for number in range(count):
            content = bytearray(draw.choice(sources))
            at, length = draw.randrange(8, len(content) - 9), draw.choice([2**62, 2**63, 2**64 - 1, 0, 3, 70 << 20])
            how = number % 6
            if how == 0:
                content[at] ^= 1 << draw.randrange(8)
            elif how == 1:
                del content[at:]
            elif how == 2:
                content[at:at] = struct.pack("<BQ", draw.randrange(16), length)
            elif how == 3:  # the length of one of the first records
                begin = 8
                for _ in range(draw.randrange(6)):
                    begin += 9 + struct.unpack_from("<Q", content, begin + 1)[0]
                content[begin + 1:begin + 9] = struct.pack("<Q", length)
            elif how == 4:
                content[at:at + draw.randrange(99)] = draw.randbytes(draw.randrange(99))
            else:
                content[8:8] = struct.pack("<BQ", 4, len(again)) + again
            path.write_bytes(content)
            try:
                with warnings.catch_warnings(action="ignore"):
                    for one in traction.recording(path):
                        self.assertNotEqual(len(getattr(one.message, "displacement_px", "-")), 0, "markers of nothing")
                silent += 1
            except traction.Malformed:
                told += 1
        self.assertGreater(told, count / 2)
        print(f"  {count} damaged recordings in Python: {told} times Malformed, {silent} read to their end; right: nothing else", end=" ")

    def test_small_files_that_unpack_to_much_take_little_memory(self):
        most_kb, slowest_s = 0, 0.0
        for name, content in hostile.recordings():
            path = self.folder / "hostile.mcap"
            path.write_bytes(content)
            for words in (("info", path), ("export", path, self.folder / "out.csv"), ("export", path, self.folder / "out.mcap"),
                          ("recover", path, self.folder / "whole.mcap")):
                begin = time.monotonic()
                child = self.start(*words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                _, status, used = os.wait4(child.pid, 0)
                child.returncode = os.waitstatus_to_exitcode(status)
                self.assertIn(child.returncode, (0, USAGE, DATA), (name, words[0]))
                self.assertLess(used.ru_maxrss, 512 << 10, (name, words[0]))
                most_kb, slowest_s = max(most_kb, used.ru_maxrss), max(slowest_s, time.monotonic() - begin)
                (self.folder / "whole.mcap").unlink(missing_ok=True)
        print(f"\n  recordings of 2 to 650 kB that unpack to gigabytes: {most_kb >> 10} MiB, {slowest_s:.1f} s at most; "
              "right: 512 MiB at most", end=" ")

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

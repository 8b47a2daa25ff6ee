"""tractionctl as a program: what it prints, how it ends, and that it leaves the terminal as it was."""

import json
import os
import pty
import select
import signal
import socket
import subprocess
import termios

import zmq
from ctl import NO_CAMERA, OUTPUT, PROTOCOL, UNAVAILABLE, USAGE, Case, answer, ctl
from deadline import HUNG_S
from traction.v1 import messages


class Tractionctl(Case):
    def test_full_disk_ends_what_prints(self):
        for command in (["echo"], ["watch"], ["top"], ["top", "--once"], ["status"], ["status", "--json"], ["describe"], ["zero"], ["--help"],
                        ["calibrate", "--weights", "1N"]):
            with self.subTest(command), open("/dev/full", "wb") as full:
                self.ends(self.start(*command, *self.publisher(), stdout=full), "No space left on device")

    def test_status_tells_where_frames_went(self):
        endpoints = self.publisher()
        code, out, _ = ctl("status", *endpoints)
        self.assertEqual(code, 0)
        self.assertIn("10 received = 7 published + 0 in flight + 3 not published", out)
        self.assertIn("3 stale", out)
        self.assertIn("drifted by (+0.125, +0.000) px", out)
        self.assertEqual(json.loads(ctl("status", "--json", *endpoints)[1])["ledger"]["stale"], 3)

    def test_a_terminal_obeys_nobody_who_answers(self):
        """ESC, BEL, the one-byte CSI, and lines that look like ours, of whoever stands in a daemon's place."""
        text = "\x1b]0;mine\a \u009b2J nächste\ntractionctl: all is well"

        def refuse(request):
            return messages.Reply(version=1, error=text)

        def tell(request):
            told = answer(request)
            told.status.camera_why = told.status.markers.remark = told.status.camera_link.ptp = text
            return told

        for reply, commands in ((refuse, (["status"], ["describe"], ["zero"], ["trigger"], ["camera", "white"],
                                          ["snapshot", "/dev/null"], ["calibrate", "geometry", "--keep-zero"])),
                                (tell, (["status"],))):
            endpoints = self.publisher(reply)
            for command in commands:
                with self.subTest(command):
                    _, out, err = ctl(*command, *endpoints)
                    self.assertIn("?]0;mine? ?2J nächste?tractionctl: all is well", out + err)
                    self.assertNotRegex(out + err, "[\x00-\x09\x0b-\x1f\x7f-\x9f]")

    def test_status_without_a_camera_has_a_code_of_its_own(self):
        for state, name in ((messages.CAMERA_STATE_LOST, "lost"), (messages.CAMERA_STATE_WAITING, "waiting"),
                            (messages.CAMERA_STATE_UNKNOWN, "unknown")):
            def reply(request, state=state):
                told = answer(request)
                told.status.camera, told.status.camera_why = state, "it does not answer"
                return told

            endpoints = self.publisher(reply)
            code, out, err = ctl("status", *endpoints)
            self.assertEqual(code, NO_CAMERA)
            self.assertIn("it does not answer", out)
            self.assertRegex(err, r"\Atractionctl: .*it does not answer.*\n\Z")
            code, out, _ = ctl("status", "--json", *endpoints)
            self.assertEqual((code, json.loads(out)["camera"]), (NO_CAMERA, name))

    def test_calibrate_goes_through_all_steps(self):
        code, out, err = ctl("calibrate", "--weights", "100gf,0.2kgf, 5N", "--json", *self.publisher())
        self.assertEqual((code, err), (0, ""))
        reports = [json.loads(line) for line in out.splitlines()]
        self.assertEqual([report["step"] for report in reports],
                         ["geometry", "noise", "weight", "weight", "weight", "stiffness", "finish"])
        weights = [report["figures"] for report in reports if report["step"] == "weight"]
        for weight, newtons in zip(weights, (0.980665, 1.96133, 5)):
            self.assertAlmostEqual(weight["weight_N"]["value"], newtons)
        self.assertEqual([weight["first"]["value"] for weight in weights], [1, 0, 0])
        self.assertEqual(reports[-1]["path"], "/gel.toml")

    def test_each_weight_has_its_direction_or_all_the_same(self):
        for stated, expected in (((), [None, None]), (("0,0.5,1",), [(0, 0.5, 1)] * 2),
                                 (("0,0,1", "-1,0,2e-1"), [(0, 0, 1), (-1, 0, 0.2)])):
            seen = []

            def note(request):
                weight = request.calibrate.weight
                if request.calibrate.WhichOneof("step") == "weight":
                    along = weight.direction
                    seen.append((along.x, along.y, along.z) if weight.HasField("direction") else None)
                return answer(request)
            words = [f"--direction={text}" for text in stated]
            self.assertEqual(ctl("calibrate", "weights", "--weights", "1N,2N", *words, *self.publisher(note))[0], 0)
            self.assertEqual(seen, expected)
        for wrong in (("0,0",), ("0,0,0",), ("0,0,1,",), ("1,0,x",), ("0,0,1", "0,0,1", "0,0,1")):
            words = [f"--direction={text}" for text in wrong]
            code, out, err = ctl("calibrate", "weights", "--weights", "1N,2N", *words, *self.publisher())
            self.assertEqual((code, out), (USAGE, ""))
            self.assertIn("direction", err)

    def test_the_seconds_of_calibrate_are_of_the_weights_where_there_are_some(self):
        for steps, expected in ((("noise", "weights", "--weights", "1N"), [0, 7, 0]), (("noise",), [7])):
            seen = []

            def note(request):
                if step := request.calibrate.WhichOneof("step"):
                    step = getattr(request.calibrate, step)
                    seen.append(getattr(step, "duration_s", 0) + getattr(step, "patience_s", 0))
                return answer(request)
            self.assertEqual(ctl("calibrate", *steps, "--seconds", "7", *self.publisher(note))[0], 0)
            self.assertEqual(seen, expected)

    def test_calibrate_tells_a_person_on_standard_error_what_json_waits_for(self):
        person, terminal = os.openpty()
        child = self.start("calibrate", "weights", "--weights", "250g", "--json", *self.publisher(), stdin=terminal,
                           stdout=subprocess.PIPE)
        self.assertEqual(child.stderr.readline(),
                         "Weights: put 250 gf on the gel, near its middle, and let go of it; then press Enter.\n")
        os.write(person, b"\n")
        self.assertEqual([json.loads(line)["step"] for line in child.stdout], ["weight", "stiffness"])
        os.close(person)
        os.close(terminal)

    def test_absent_daemon_is_unavailable(self):
        for command in ("status", "zero", "describe", "trigger"):
            self.fails(UNAVAILABLE, r"is tractiond running\?", command, "--instance", "absent")
        for command in (["watch"], ["echo"], ["top"], ["top", "--once"]):
            self.fails(UNAVAILABLE, r"is tractiond running\?", *command, "--connect", "ipc://@traction-nobody")
        self.fails(UNAVAILABLE, r"traction-nobody, .*traction-none; is tractiond running\?", "top",
                   "ipc://@traction-nobody", "ipc://@traction-none")

    def test_who_is_not_there_is_not_waited_for(self):
        with socket.socket() as nobody:
            nobody.bind(("127.0.0.1", 0))  # and does not listen
            endpoint = f"tcp://127.0.0.1:{nobody.getsockname()[1]}"
            # Answers to them are waited for for 10 min, longer than HUNG_S, 60 s and 15 s.
            for command in (["calibrate", "noise"], ["camera"], ["zero"]):
                self.fails(UNAVAILABLE, rf"nothing answers at {endpoint}; is tractiond running\?", *command, "--control",
                           endpoint)

    def test_who_is_there_but_takes_no_requests_is_told(self):
        _, stream, *_ = self.publisher()
        self.fails(UNAVAILABLE, "takes no requests; is it the endpoint 'control'", "status", "--control", stream)
        self.fails(UNAVAILABLE, "has not answered within 3 s", "status", "--control", self.socket(zmq.REP)[1])

    def test_other_version_is_a_protocol_error(self):
        self.fails(PROTOCOL, "version 2", "status", *self.publisher(lambda _: messages.Reply(version=2)))
        for command in ("watch", "echo"):
            stream, endpoint = self.socket()
            child = self.start(command, "--connect", endpoint)
            self.assertTrue(stream.poll(1000 * HUNG_S))  # it has subscribed
            stream.send_multipart([b"traction/v2/gel/field/", b"", b"0.0"])
            _, err = child.communicate(timeout=HUNG_S)
            self.assertEqual(child.returncode, PROTOCOL)
            self.assertRegex(err, r"\Atractionctl: .*traction/v2.*\n\Z")

    def test_wrong_words_are_a_usage_error_that_names_them(self):
        calibrate, weights = ["calibrate", "noise"], ["calibrate", "weights"]
        for pattern, *words in (
                ("a command is needed",), ("not expected: nonsense; see tractionctl --help", "nonsense"),
                ("not expected: .*--topic", "status", "--topic", "x"), ("not expected: now", "zero", "now"),
                ("--instance: 1 required INSTANCE missing", "--instance"),
                *((f"--count: '{count}'", "echo", f"--count={count}") for count in ("x", "-1", "99999999999999999999")),
                ("--name: 'a b'", *calibrate, "--name", "a b"), ("--topic", "echo", "--topic", "nonsense"),
                ("nonsense", "calibrate", "nonsense"), ("--weights", "calibrate"),
                *((f"'{one}' is not a list of weights", *weights, f"--weights={one}")
                  for one in ("100", "100lb", "0gf", "-5N", "nan N", "5N,", "1001kN", "1e300kgf")),
                *((f"--seconds: '{one}' is not a time from 0", "watch", f"--seconds={one}") for one in ("-1", "nan", "1s", "1e999")),
                *((f"--seconds: '{one}' is not a time above 0", *calibrate, f"--seconds={one}") for one in ("0", "3601", "nan")),
                *((f"--speed: '{one}'", "replay", "/dev/null", f"--speed={one}") for one in ("0", "1e300", "nan")),
                ("instance", "watch", "--instance", "../etc"), ("instance", "top", "../etc"),
                *(("cannot connect to 'nonsense': .*; an endpoint is written", command, option, "nonsense")
                  for command, option in (("watch", "--connect"), ("status", "--control")))):
            with self.subTest(words):
                self.fails(USAGE, pattern, *words)

    def in_terminal(self, ending, *words, until=lambda output: b"+3.500" in output, **env):
        """Runs in a pseudo terminal, ends it by `ending(child, terminal)` once the output is as wanted; (exit code, output,
        settings kept).
        """
        leader, terminal = pty.openpty()
        self.leader = leader
        self.addCleanup(os.close, leader)
        self.addCleanup(os.close, terminal)
        termios.tcsetwinsize(terminal, (30, 100))
        before = termios.tcgetattr(terminal)
        child = self.start(*words, stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
                           env={**os.environ, "LC_ALL": "C.UTF-8", "TERM": "xterm-256color", **env})
        output = b""
        ended = False
        while True:
            over = child.poll() is not None  # so all is there that will be printed
            if select.select([leader], [], [], 0 if over else 0.05)[0]:
                output += os.read(leader, 65536)
            elif over:
                break
            if not ended and until(output):
                ended = True
                ending(child, leader)
        self.assertTrue(ended, output)
        return child.returncode, output.decode(errors="replace"), termios.tcgetattr(terminal) == before

    def test_watch_restores_the_terminal(self):
        endpoints = self.publisher()
        endings = {
            "Ctrl-C": lambda child, _: child.send_signal(signal.SIGINT),
            "terminated": lambda child, _: child.send_signal(signal.SIGTERM),
            "q": lambda _, leader: os.write(leader, b"q"),
        }
        for name, ending in endings.items():
            for command in ("watch", "top"):
                with self.subTest(name, command=command):
                    self.restores(command, endpoints, ending)

    def restores(self, command, endpoints, ending):
        code, out, kept = self.in_terminal(ending, command, *endpoints)
        self.assertEqual(code, 0)
        self.assertTrue(kept)
        self.assertIn("\x1b[?1049h", out)
        left = out[out.rindex("\x1b[?1049l"):]
        self.assertRegex(left, r"\d+ fields received, 0 messages lost" if command == "watch" else "l$")
        self.assertGreater(out.rindex("\x1b[?25h"), out.rindex("\x1b[?25l"))

    def test_top_shows_numbers_on_a_terminal_of_any_size(self):
        def quit(_, leader):
            os.write(leader, b"q")

        def is_small(output):
            """Makes the terminal smaller once there are numbers; whether a whole page of that size has come."""
            nonlocal resized
            if not resized and b"+3.500" in output:
                termios.tcsetwinsize(self.leader, (24, 80))
                resized = True
            pages = output.split(b"\x1b[H")[1:-1]
            return resized and len(pages) > 0 and b"\x1b[24;1H" in pages[-1] and b"\x1b[30;1H" not in pages[-1]

        resized = False
        _, out, _ = self.in_terminal(quit, "top", *self.publisher(), until=is_small, NO_COLOR="1")
        self.assertIn("+1.500 -2.500 +3.500 N", out)
        self.assertNotRegex(out, r"\x1b\[[0-9;]*[34]8;")
        large, small = out.index("\x1b[30;1H"), out.rindex("\x1b[24;1H")  # the lowest rows
        self.assertNotIn("\x1b[30;1H", out[out.rindex("\x1b[H"):])
        self.assertLess(large, small)
        _, out, _ = self.in_terminal(quit, "top", *self.publisher())
        self.assertRegex(out, r"\x1b\[[0-9;]*38;5;")

    def test_watch_ends_with_its_terminal(self):
        leader, terminal = pty.openpty()
        child = self.start("watch", *self.publisher(), stdin=terminal, stdout=terminal, stderr=subprocess.DEVNULL,
                           env={**os.environ, "LC_ALL": "C.UTF-8", "TERM": "xterm-256color"})
        os.close(terminal)
        output = b""
        while b"+3.500" not in output:
            output += os.read(leader, 65536)
        os.close(leader)
        self.assertEqual(child.wait(HUNG_S), OUTPUT)

"""Text of anybody's in every field of every message: no command of a terminal leaves a program that prints it."""

import re
import subprocess
import threading
import unittest

import zmq
from ctl import Case, ctl
from deadline import HUNG_S
from traction.v1 import messages

EVIL = "a\x1b]0;evil\x07\x9b31m\u202eb\u2028c\rd\ne\x7f"
COMMAND = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]|\ne")
ANSWERED = (("status",), ("status", "--json"), ("describe",), ("zero",), ("zero", "--json"), ("camera", "list"), ("camera", "list", "--json"),
            ("calibrate", "--yes", "noise"), ("calibrate", "--yes", "--json", "noise"), ("metrics",))
STREAMED = {"field": messages.Field, "markers": messages.Markers, "status": messages.Status, "description": messages.Description,
            "contacts": messages.Contacts, "grasp": messages.Grasp}


def fill(message, depth=0):
    """Puts EVIL into each text, and one element into each list of messages."""
    for field in message.DESCRIPTOR.fields:
        repeated = field.label == field.LABEL_REPEATED
        if field.type == field.TYPE_STRING:
            getattr(message, field.name).append(EVIL) if repeated else setattr(message, field.name, EVIL)
        elif field.type == field.TYPE_MESSAGE and depth < 4 and not (repeated and field.message_type.GetOptions().map_entry):
            inner = getattr(message, field.name)
            fill(inner.add() if repeated else inner, depth + 1)
    return message


class Escapes(Case):
    def expect_none(self, words, out):
        found = COMMAND.search(out)
        self.assertIsNone(found, f"{words}: {out[max(0, found.start() - 99):found.end() + 20]!r}" if found else "")

    def test_no_answer_commands_the_terminal(self):
        def answer(request):
            reply = messages.Reply(version=1)
            kind = request.WhichOneof("request")
            fill(getattr(reply, kind))
            return reply

        endpoints = self.publisher(answer)
        for words in ANSWERED:
            with self.subTest(words):
                _, out, err = ctl(*words, "--control", endpoints[3])
                self.assertIn("evil", out + err)
                self.expect_none(words, out + err)
        refused = self.publisher(lambda request: messages.Reply(version=1, error=EVIL))
        self.expect_none("an error", "".join(ctl("zero", "--control", refused[3])[1:]))
        print(f"\n  {len(ANSWERED)} commands print answers with escapes in every text: none reaches the terminal; right: none", end=" ")

    def test_no_message_of_a_stream_commands_the_terminal(self):
        parts = []
        for topic, kind in STREAMED.items():
            message = fill(kind())
            message.header.sensor, message.header.boot = "gel" if topic == "field" else EVIL, bytes(range(16))
            parts.append([f"traction/v1/gel/{topic}/".encode(), message.SerializeToString(), b"0.0"])
        for words in (*(("echo", "--topic", topic) for topic in STREAMED), ("watch",), ("touch",), ("top",)):
            with self.subTest(words):
                stream, endpoint = self.socket(zmq.PUB)
                child = self.start(*words, "--connect", endpoint, stdout=subprocess.PIPE, encoding="utf-8", errors="surrogateescape")
                over = threading.Event()
                sender = threading.Thread(target=self.send, args=(stream, parts, over))
                sender.start()
                out = child.stdout.readline()
                over.set()
                sender.join()
                self.assertTrue(out, words)
                child.kill()
                rest, err = child.communicate(timeout=HUNG_S)
                self.expect_none(words, out + rest + err)

    @staticmethod
    def send(stream, parts, over):
        while not over.wait(0.02):
            for part in parts:
                stream.send_multipart(part)


if __name__ == "__main__":
    unittest.main()

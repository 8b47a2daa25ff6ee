"""tractionctl keys: what it writes, what it prints, what it refuses."""

import json
import os
import pathlib
import shlex
import stat
import tempfile
import unittest

import zmq
from ctl import USAGE, Case, ctl

NO_INPUT, DATA, CREATE, CONFIG, NO_PERMISSION = 66, 65, 73, 78, 77


class Keys(Case):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))
        self.box = ["--directory", str(self.folder / "keys")]
        self.own = str(self.folder / "laptop" / "key")

    def done(self, *words):
        code, out, err = ctl(*words)
        self.assertEqual((code, err), (0, ""))
        return out

    def test_a_key_is_made_allowed_listed_and_taken_back(self):
        line = shlex.split(self.done("keys", "new", "ada", "--key", self.own))
        self.assertEqual(line[:5], ["sudo", "tractionctl", "keys", "allow", "ada"])
        text = pathlib.Path(self.own).read_text()
        public, secret = (text.split(f'{name} = "')[1].split('"')[0] for name in ("public", "secret"))
        self.assertEqual((line[5], zmq.curve_public(secret.encode()).decode()), (public, public))
        self.assertNotIn(secret, line)
        self.assertEqual(stat.S_IMODE(os.stat(self.own).st_mode), 0o600)

        connect = shlex.split(self.done(*line[2:], *self.box))
        self.assertEqual(connect[:3], ["tractionctl", "watch", "--host"])
        self.assertEqual(self.done("keys", "allow", "bob", zmq.curve_keypair()[0].decode(), "--control", *self.box),
                         shlex.join(connect[:4]) + f" --server-key '{connect[5]}'\n")  # the box's key stays
        known = json.loads(self.done("keys", "list", "--json", *self.box))
        self.assertEqual(known["server_key"], connect[5])
        self.assertEqual([(one["name"], one["permission"]) for one in known["allowed"]],
                         [("ada", "read"), ("bob", "control")])
        self.assertEqual(known["allowed"][0]["key"], public)
        lines = self.done("keys", "list", *self.box).splitlines()
        self.assertEqual(lines[0], f"this box's key is '{connect[5]}'")
        self.assertRegex(lines[1], r"^ada +read +'")

        self.assertEqual(self.done("keys", "revoke", "ada", *self.box), "")
        self.assertEqual(len(json.loads(self.done("keys", "list", "--json", *self.box))["allowed"]), 1)

    def test_a_key_is_no_option_whatever_its_first_letters(self):
        self.done("keys", "new", "ada", "--key", self.own)
        for first in ("-=", "--b)"):
            key = first + "cdefghijklmnopqrstuvwxyz0123456789ABCDEF"[len(first):]
            for number, words in enumerate([[key], [key, "--control"], ["--", key]]):
                with self.subTest(key=key, words=words):
                    directory = ["--directory", str(self.folder / f"keys{number}")]
                    self.done("keys", "allow", "bob", *directory, *words)
                    known = json.loads(self.done("keys", "list", "--json", *directory))["allowed"]
                    self.assertEqual([(one["key"], one["permission"]) for one in known],
                                     [(key, "control" if "--control" in words else "read")])
        code, _, err = ctl("status", "--host", "127.0.0.1:1", "--key", self.own, "--server-key", key)
        self.assertEqual((code, err.count("nothing answers at")), (69, 1), err)

    def test_mistakes_are_told(self):
        key = zmq.curve_keypair()[0].decode()
        self.done("keys", "new", "ada", "--key", self.own)
        self.done("keys", "allow", "ada", key, *self.box)
        self.fails(CREATE, "there is a file already; a key is not replaced", "keys", "new", "ada", "--key", self.own)
        self.fails(USAGE, "the box's key is missing: --server-key KEY, or a line server = ", "status", "--host", "127.0.0.1:1",
                   "--key", self.own)  # never without encryption
        self.fails(USAGE, "no name for a key", "keys", "new", "../ada", "--key", self.own + "2")
        self.fails(USAGE, "no name for a key", "keys", "allow", "a b", key, *self.box)
        self.fails(USAGE, "is not a key: 40 letters of Z85; .*single quotes", "keys", "allow", "bob", key[1:], *self.box)
        self.fails(DATA, 'this key is "ada"\'s', "keys", "allow", "bob", key, *self.box)
        self.fails(NO_INPUT, 'no client "bob" is allowed', "keys", "revoke", "bob", *self.box)
        self.fails(USAGE, "missing command, one of new, allow, revoke, list", "keys")
        self.fails(CONFIG, "cannot be read", "status", "--host", "127.0.0.1", "--key", "/nowhere")
        self.fails(CONFIG, "server key 'x' is not a key", "status", "--host", "127.0.0.1", "--key", self.own,
                   "--server-key", "x")
        self.fails(USAGE, "'box:port' is not HOST or HOST:PORT", "status", "--host", "box:port")

    def test_nothing_is_allowed_where_that_would_have_no_effect(self):
        folder = self.folder / "keys"
        key = zmq.curve_keypair()[0].decode()
        self.done("keys", "allow", "ada", zmq.curve_keypair()[0].decode(), *self.box)
        secret = (folder / "gateway.secret").read_text()
        (folder / "gateway.secret").write_text("public = 1\n")
        self.fails(CONFIG, "gateway.secret", "keys", "allow", "bob", key, *self.box)
        self.assertFalse((folder / "bob.key").exists())
        (folder / "gateway.secret").write_text(secret)
        folder.chmod(0o777)
        self.fails(NO_PERMISSION, "every user of this machine can write", "keys", "allow", "bob", key, *self.box)
        self.assertFalse((folder / "bob.key").exists())
        folder.chmod(0o755)
        for number in range(999):
            (folder / f"c{number}.key").write_text("")
        self.fails(CONFIG, "1000 keys are in .*, and with more none is taken", "keys", "allow", "bob", key, *self.box)
        self.assertFalse((folder / "bob.key").exists())
        self.done("keys", "allow", "ada", key, *self.box)  # replaces one
        (folder / "bob.key").write_text("")
        self.fails(CONFIG, "more than 1000 keys", "keys", "allow", "ada", key, *self.box)


if __name__ == "__main__":
    unittest.main()

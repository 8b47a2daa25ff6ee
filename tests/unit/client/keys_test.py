"""tractionctl keys: what it writes, what it prints, what it refuses."""

import json
import os
import pathlib
import shlex
import stat
import tempfile

import zmq
from ctl import USAGE, Case, ctl

NO_INPUT, DATA, CREATE, CONFIG, NO_PERMISSION = 66, 65, 73, 78, 77


def public_key():
    """One that is no option by its first letter."""
    return next(key for key in iter(lambda: zmq.curve_keypair()[0].decode(), "") if not key.startswith("-"))


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
        self.assertEqual(self.done("keys", "allow", "bob", public_key(), "--control", *self.box),
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

    def test_mistakes_are_told(self):
        key = public_key()
        self.done("keys", "new", "ada", "--key", self.own)
        self.done("keys", "allow", "ada", key, *self.box)
        self.fails(CREATE, "there is a file already; a key is not replaced", "keys", "new", "ada", "--key", self.own)
        self.fails(USAGE, "the box's key is missing: --server-key KEY, or a line server = ", "status", "--host", "127.0.0.1:1",
                   "--key", self.own)  # never without encryption
        self.fails(USAGE, "no name for a key", "keys", "new", "../ada", "--key", self.own + "2")
        self.fails(USAGE, "no name for a key", "keys", "allow", "a b", key, *self.box)
        self.fails(USAGE, "is not a key: 40 letters of Z85; .*single quotes", "keys", "allow", "bob", key[:-1], *self.box)
        self.fails(DATA, 'this key is "ada"\'s', "keys", "allow", "bob", key, *self.box)
        self.fails(NO_INPUT, 'no client "bob" is allowed', "keys", "revoke", "bob", *self.box)
        self.fails(USAGE, "A subcommand is required", "keys")
        self.fails(CONFIG, "cannot be read", "status", "--host", "127.0.0.1", "--key", "/nowhere")
        self.fails(CONFIG, "server key 'x' is not a key", "status", "--host", "127.0.0.1", "--key", self.own,
                   "--server-key", "x")
        self.fails(USAGE, "'box:port' is not HOST or HOST:PORT", "status", "--host", "box:port")

    def test_nothing_is_allowed_where_that_would_have_no_effect(self):
        folder = self.folder / "keys"
        key = public_key()
        self.done("keys", "allow", "ada", public_key(), *self.box)
        secret = (folder / "gateway.secret").read_text()
        (folder / "gateway.secret").write_text("public = 1\n")
        self.fails(CONFIG, "gateway.secret", "keys", "allow", "bob", key, *self.box)
        self.assertFalse((folder / "bob.key").exists())
        (folder / "gateway.secret").write_text(secret)
        folder.chmod(0o777)
        self.fails(NO_PERMISSION, "every user of this machine can write", "keys", "allow", "bob", key, *self.box)
        self.assertFalse((folder / "bob.key").exists())

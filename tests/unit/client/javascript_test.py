"""The JavaScript client's own parts, without a server."""

import pathlib
import subprocess
import unittest

CLIENT = pathlib.Path(__file__).resolve().parents[3] / "client" / "javascript"


class Pairs(unittest.TestCase):
    def run_script(self, script):
        script = f"""import assert from "node:assert/strict";
            import {{PairedContacts}} from "{(CLIENT / 'paired_contacts.js').as_uri()}";
            const header = {{sequence: 1n}}, of = (run, ...contacts) => ({{header, run, valid: true, contacts}});
            {script}"""
        done = subprocess.run(["node", "--input-type=module", "-e", script], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_a_silence_ends_them_and_a_busy_reader_does_not(self):
        self.run_script("""const paired = new PairedContacts(), phases = ({contacts}) => contacts.map(({phase}) => phase);
            paired.complete(of("a", {id: 1n, phase: "begin", force_N: [0, 0, 1]}), 0);
            assert.equal(paired.endIfSilent(999), null);
            assert.equal(paired.endIfSilent(10_000), null);  // the reader was busy: what waited comes before the next turn
            const waited = of("a", {id: 1n, phase: "move"});
            paired.complete(waited, 10_001);
            assert.deepEqual(phases(waited), ["move"]);
            assert.equal(paired.endIfSilent(10_250), null);
            assert.equal(paired.endIfSilent(11_001), null);
            const ends = paired.endIfSilent(11_251);
            assert.deepEqual(phases(ends), ["end"]);
            assert.deepEqual(ends.contacts[0].force_N, [0, 0, 0]);
            assert.equal(ends.valid, false);
            assert.equal(paired.endIfSilent(20_000), null);""")

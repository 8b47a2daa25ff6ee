"""The JavaScript client's own parts, without a server."""

import pathlib
import subprocess
import unittest

import seed

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

    def test_begins_and_ends_pair_whatever_is_lost(self):
        begun = self.run_script("let state = " + str(seed.chance(self.id()).randrange(2**32)) + """;
            const chance = (share) => {  // mulberry32
              state = (state + 0x6d2b79f5) | 0;
              let t = Math.imul(state ^ (state >>> 15), 1 | state);
              t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
              return ((t ^ (t >>> 14)) >>> 0) / 4294967296 < share;
            };
            const phases = ["begin", "move", "absent", "unknown", "none", "end"];
            let begun = 0;
            for (let sequence = 0; sequence < 500; ++sequence) {
              const paired = new PairedContacts(), open = new Map();
              let run = 0, now_ms = 0;
              const check = ({run, contacts}) => {
                for (const {id, phase} of contacts) {
                  assert.equal(open.has(id), phase !== "begin");
                  if (phase === "begin") { open.set(id, run); ++begun; }
                  else if (phase === "end") open.delete(id);
                  else assert.equal(open.get(id), run);
                }
                assert.equal(contacts.filter(({phase}) => phase !== "end").length, open.size);
              };
              for (let frame = 0; frame < 40; ++frame, now_ms += 17) {
                if (chance(0.05)) ++run;
                const message = of(run);
                for (let id = 0n; id < 4n; ++id) {
                  if (chance(0.7)) message.contacts.push({id, phase: phases[chance(0.5) ? 1 : chance(0.3) ? 0 : chance(0.3) ? 2 : chance(0.5) ? 5 : 3]});
                }
                paired.complete(message, now_ms);
                check(message);
                if (!chance(0.02)) continue;
                now_ms += 1000;
                assert.equal(paired.endIfSilent(now_ms), null);
                const ends = paired.endIfSilent(now_ms);
                if (ends) check(ends);
                assert.equal(open.size, 0);
              }
            }
            console.log(begun);""")
        self.assertGreater(int(begun), 3_000)

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


if __name__ == "__main__":
    unittest.main()

"""What tests of tractiond --replay have in common."""

import numpy as np

import rig


class Replays:
    """A part of a TestCase."""

    def replay(self, bench, path, *options, code=0, name="again"):
        again = bench.folder / f"{name}.mcap"
        again.unlink(missing_ok=True)
        state = bench.folder / "default" / "state"
        process = bench.start(rig.BIN / "tractiond", "--replay", path, "--replay-rate", "0", "--record", again,
                              "--state", state, "--runtime", bench.folder / "replay-run", *options)
        self.assertEqual(process.join(), code, process.output())
        return again, process

    def arrays(self, bench, path):
        file = bench.folder / (path.stem + ".npz")
        code, out = bench.ctl("export", path, file)
        self.assertEqual((code, out), (0, ""))
        loaded = np.load(file)
        return {key: loaded[key] for key in loaded.files}

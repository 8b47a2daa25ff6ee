"""Makes golden recordings anew, as tests/system runs its tests: python3 make.py FOLDER SCENARIO...

Pictures of a touch with a zero taken before it, a second apart, and the fields that this build computes of them. Where the
solver changes, the pictures stay: `tractiond --replay OLD --record-packed --record NEW`, twice, as only the second has
the calibration's id from its beginning. The first daemon's configuration stays in them, too. Those in `earlier` stay as
an earlier version has made them.
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

import numpy as np  # noqa: E402

import rig  # noqa: E402

PICTURES_HZ, SECONDS = 1, 1.2
TOUCHED_N = 1.0


def make(folder, scenario):
    format_, gel = ("Mono8", "black_dots") if scenario == "black_dots" else ("BayerRG8", "paper")
    config = f'pixel_format = "{format_}"\n[sensor]\ngel_file = "{rig.SOURCE}/config/gels/{gel}.toml"\n'
    is_touched = "[[contacts]]" in (rig.SOURCE / "twin/scenarios" / f"{scenario}.toml").read_text()
    with rig.Rig() as bench:
        bench.twin(scenario, "--format", format_, "--rate", "30", truth=False)
        first = bench.daemon(config)
        fields = bench.subscribe(first)
        fields.collect(1)
        code, out = bench.ctl("zero", "--control", first.endpoint["control"])
        assert code == 0, out
        if is_touched:
            fields.collect(seconds=90, until=lambda field: not field.valid or  # where the gel file is not the gel's
                           np.linalg.norm(rig.vector(field.resultant_N)) > TOUCHED_N)
        first.stop()
        raw, golden = bench.folder / "raw.mcap", pathlib.Path(folder) / f"{scenario}.mcap"
        second = bench.daemon(config, "--record", raw, "--record-hz", PICTURES_HZ)
        fields = bench.subscribe(second)
        begin = fields.collect(1)[0].header.received_ns
        fields.collect(until=lambda field: field.header.received_ns > begin + SECONDS * 1e9)
        second.stop()
        golden.unlink(missing_ok=True)
        process = bench.start(rig.BIN / "tractiond", "--replay", raw, "--replay-rate", "0", "--record", golden, "--record-packed",
                              "--state", second.state, "--runtime", bench.folder / "golden")
        assert process.join(120) == 0, process.output()
        print(process.output())


for name in sys.argv[2:]:
    make(sys.argv[1], name)

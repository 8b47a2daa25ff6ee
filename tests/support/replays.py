"""What tests of tractiond --replay have in common."""

import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client/python"))
import rig  # noqa: E402
import traction  # noqa: E402


class Replays:
    """A part of a rig.TestCase."""

    def replay(self, path, *options, code=0, name="again"):
        again = self.bench.folder / f"{name}.mcap"
        again.unlink(missing_ok=True)
        state = self.bench.folder / "default" / "state"
        rig.lend_factors(state)
        process = self.bench.start(rig.BIN / "tractiond", "--replay", path, "--replay-rate", "0", "--record", again,
                              "--state", state, "--runtime", self.bench.folder / "replay-run", *options)
        self.assertEqual(process.join(), code, process.output())
        rig.keep_factors(state)
        return again, process

    def arrays(self, path):
        """What a recording has of each field, by its name."""
        fields = [(each, each.message) for each in traction.recording(path) if isinstance(each.message, traction.Field)]
        columns = {"capture_time_ns": [each.publish_time_ns for each, _ in fields]}
        for name in ("captured_ns", "captured_error_ns", "received_ns", "frame_number", "camera_frame_id", "flags"):
            columns[name] = [getattr(field.header, name) for _, field in fields]
        for name in ("valid", "method", "residual_px", "valid_markers", "centre_of_pressure_valid", "centre_of_pressure_m",
                     "resultant_N", "moment_Nm"):
            columns[name] = [getattr(field, name) for _, field in fields]
        for name in ("force_N", "node_deviation_N", "node_valid"):  # zeros where a field has none
            rows = [getattr(field, name) for _, field in fields]
            none = np.zeros_like(max(rows, key=len))
            columns[name] = [row if len(row) else none for row in rows]
        for name in ("resultant_covariance_N2", "moment_covariance_N2m2"):
            columns[name] = [np.add(of.noise, of.systematic) for of in (getattr(field, name) for _, field in fields)]
        return {name: np.array(column) for name, column in columns.items()}

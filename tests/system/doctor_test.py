"""tractionctl doctor on the machine that there is, beside a daemon that runs."""

import json
import os
import unittest

import rig


class Doctor(unittest.TestCase):
    def measurement(self, bench, instance):
        """What it finds of the fields of an instance."""
        doctor = bench.start(rig.BIN / "tractionctl", "doctor", "--json", "--instance", instance,
                             env={"XDG_RUNTIME_DIR": str(bench.folder)})
        doctor.join()
        return next(one for one in json.loads(doctor.output())["checks"] if one["check"] == "measurement")

    def test_a_daemon_that_runs(self):
        with rig.Rig() as bench:
            name = f"ward{os.getpid()}"  # tests beside this one have daemons, too
            self.assertIn("is tractiond running?", self.measurement(bench, name)["found"])
            bench.twin("hold", truth=False)
            bench.daemon(instance=name)
            (bench.folder / "tractiond").mkdir()
            (bench.folder / "tractiond" / name).symlink_to(bench.folder / name / "run")  # where a user's instances are
            self.assertNotEqual(self.measurement(bench, name)["verdict"], "unknown")

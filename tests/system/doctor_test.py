"""tractionctl doctor on the machine that there is, beside programs that are there: against what others say of it."""

import json
import os
import unittest

import rig


class Doctor(unittest.TestCase):
    def examined(self, bench, instance="default"):
        """Its findings by their checks."""
        code, out = bench.ctl("doctor", "--json", "--instance", instance)
        report = json.loads(out)
        self.assertEqual(code, report["exit_code"])
        verdicts = {one["verdict"] for one in report["checks"]}
        self.assertEqual(code, 2 if "fail" in verdicts else 1 if "warn" in verdicts else 0)
        for one in report["checks"]:
            self.assertEqual(one["mend"] != "", one["verdict"] in ("warn", "fail"), one)
        return {one["check"]: one for one in report["checks"]}

    def test_a_daemon_that_runs(self):
        with rig.Rig() as bench:
            name = f"ward{os.getpid()}"  # tests beside this one have daemons, too
            self.assertIn("does not run", self.examined(bench, name)["measurement"]["found"])
            bench.twin("hold", truth=False)
            bench.daemon(instance=name)
            self.assertNotIn("does not run", self.examined(bench, name)["measurement"]["found"])


if __name__ == "__main__":
    unittest.main()

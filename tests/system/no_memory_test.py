"""An answer for which the daemon has no memory is lost, and counted where an operator looks."""

import unittest

import rig


class NoMemory(unittest.TestCase):
    def test_lost_answers_are_in_the_status(self):
        bench = self.enterContext(rig.Rig())
        daemon = bench.daemon('[sensor]\ngel_file = "none"\n',
                              env={"LD_PRELOAD": rig.BUILD / "tests/support/traction_no_memory.so", "TRACTION_NO_MEMORY": "1"})
        bench.start(rig.BIN / "tractionctl", "status", "--control", daemon.endpoint["control"])  # waits in vain
        statuses = bench.subscribe(daemon, "traction/v1/default/status/")
        status = statuses.collect(kind="status", until=lambda status: status.answers_unsent)[-1]
        self.assertEqual(status.answers_unsent, 1)
        daemon.wait_for("warning: 1 answer to requests could not be sent: Cannot allocate memory")
        _, text = bench.ctl("status", "--control", daemon.endpoint["control"])
        self.assertRegex(text, "(?m)^requests +1 answers could not be sent: there was no memory for them$")


if __name__ == "__main__":
    unittest.main()

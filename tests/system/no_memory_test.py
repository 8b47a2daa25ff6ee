"""Answers and messages for which the daemon has no memory are lost, and counted where an operator looks."""

import unittest

import rig


class NoMemory(unittest.TestCase):
    def daemon(self, thread):
        """Starts one whose thread of this name has no memory for its first message. Returns it and the rig."""
        bench = self.enterContext(rig.Rig())
        env = {"LD_PRELOAD": rig.BUILD / "tests/support/traction_no_memory.so", "TRACTION_NO_MEMORY": f"{thread}:1"}
        return bench.daemon('[sensor]\ngel_file = "none"\n', env=env), bench

    def await_status(self, bench, daemon, field):
        statuses = bench.subscribe(daemon, "traction/v1/default/status/")
        status = statuses.collect(kind="status", until=lambda status: getattr(status, field))[-1]
        self.assertEqual(getattr(status, field), 1)
        return bench.ctl("status", "--control", daemon.endpoint["control"])[1]

    def test_lost_answers_are_in_the_status(self):
        daemon, bench = self.daemon("tr-control")
        bench.start(rig.BIN / "tractionctl", "status", "--control", daemon.endpoint["control"])  # waits in vain
        text = self.await_status(bench, daemon, "answers_unsent")
        daemon.wait_for("warning: 1 answer to requests could not be sent: Cannot allocate memory")
        self.assertRegex(text, "(?m)^requests +1 answers could not be sent: there was no memory for them$")

    def test_lost_messages_are_in_the_status(self):
        daemon, bench = self.daemon("tr-publish")
        text = self.await_status(bench, daemon, "messages_unsent")
        daemon.wait_for("warning: messages lost as there was no memory to publish them: 1")
        self.assertRegex(text, "(?m)^messages +1 could not be published: there was no memory for them$")


if __name__ == "__main__":
    unittest.main()

"""Two instances on two cameras, side by side."""

import unittest

import rig


class Instances(unittest.TestCase):
    def test_two_cameras_two_daemons(self):
        with rig.Rig() as bench:
            twins = [bench.twin(name, address=address, ready=False)
                     for name, address in (("press", "127.0.0.1"), ("idle", "127.0.0.2"))]
            daemons = [bench.daemon(f'[sensor]\nname = "{name}"\n', instance=name, camera=address)
                       for name, address in (("left", "127.0.0.1"), ("right", "127.0.0.2"))]
            subscribers = [bench.subscribe(daemon) for daemon in daemons]
            pressed = subscribers[0].collect(until=lambda field: field.resultant_N.z > 3.0)[-1]
            self.assertEqual(pressed.header.sensor, "left")
            idle = subscribers[1].collect(60)
            for field in idle:
                self.assertEqual(field.header.sensor, "right")
                self.assertLess(abs(field.resultant_N.z), 1.0)
            for process in daemons + twins:
                self.assertEqual(process.stop(), 0, process.output())


if __name__ == "__main__":
    unittest.main()

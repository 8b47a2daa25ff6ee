"""Messages of a sensor that does not exist, and what of them is published in ROS 2. Lets the client be imported."""

import pathlib
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(SOURCE / "client" / "python"), str(SOURCE / "client" / "examples" / "python")]
from traction import ros2  # noqa: E402
from traction.decode import decode  # noqa: E402
from traction.v1 import messages  # noqa: E402

CALIBRATION = b"c" * 16


class Sensor:
    """Makes messages of one sensor as they are sent, at random: (kind, bytes)."""

    def __init__(self, draw, name="gel-1", rows=5, columns=7, calibration=CALIBRATION):
        self.draw, self.name, self.rows, self.columns, self.calibration = draw, name, rows, columns, calibration
        self.sequence = 0
        self.received_ns = draw.randrange(10**9, 10**15)

    def head(self, message, flags=0, step_ns=16_666_667, captured=True):
        header = message.header
        self.sequence += 1
        self.received_ns += step_ns
        header.sequence, header.sensor, header.boot, header.zero = self.sequence, self.name, b"b" * 16, b"z" * 16
        header.calibration, header.flags = self.calibration, int(flags)
        header.received_ns, header.received_real_ns = self.received_ns, self.draw.randrange(10**18, 2 * 10**18)
        header.captured_ns = self.received_ns - self.draw.randrange(10**8) if captured else 0

    def numbers(self, count, scale):
        return [self.draw.gauss(0, scale) for _ in range(count)]

    def field(self, flags=0, valid=True, bad_nodes=True, deviations=True, **head):
        message, nodes = messages.Field(valid=valid), self.rows * self.columns
        self.head(message, flags, **head)
        good = [not bad_nodes or self.draw.random() < 0.9 for _ in range(nodes)]
        message.node_valid = bytes(good)
        message.force_N.extend(force * good[i // 3] for i, force in enumerate(self.numbers(3 * nodes, 0.1)))
        if deviations:
            message.node_deviation_N.extend(map(abs, self.numbers(3 * nodes, 0.01)))
        for vector in (message.resultant_N, message.moment_Nm):
            vector.x, vector.y, vector.z = self.numbers(3, 1)
        return "field", message.SerializeToString()

    def contacts(self, count=2):
        """Each of another phase; the first is seen."""
        message = messages.Contacts(run=b"r" * 16, valid=True)
        self.head(message)
        for id, phase in zip(range(1, count + 1), (1, 3, 4, 5)):
            contact = message.contacts.add(id=id, phase=phase, seen_ns=id, radius_m=3e-3)
            contact.half_axes_m.x, contact.half_axes_m.y, contact.orientation_rad = 4e-3, 2e-3, self.draw.uniform(-1.5, 1.5)
            for vector in (contact.force_N, contact.moment_Nm):
                vector.x, vector.y, vector.z = self.numbers(3, 1)
            contact.position_m.x, contact.position_m.y = self.numbers(2, 0.01)
            if self.draw.random() < 0.5:
                contact.slip.state = 2
                contact.slip.stick_ratio.estimate, contact.slip.friction.low = self.draw.random(), self.draw.random()
        return "contacts", message.SerializeToString()

    def description(self, body=False):
        message = messages.Description()
        self.head(message)
        message.layers.add(columns=8, rows=6)
        message.calibration.id = self.calibration
        message.nodes.rows, message.nodes.columns, message.nodes.pitch_m = self.rows, self.columns, self.draw.uniform(1e-3, 3e-3)
        message.nodes.centre_m.x, message.nodes.centre_m.y = self.numbers(2, 1e-3)
        for vector, scale in ((message.camera.position_m, 0.1), (message.camera.rotation_rad, 0.5)):
            vector.x, vector.y, vector.z = self.numbers(3, scale)
        if body:
            nodes = self.rows * self.columns
            message.body.node_positions_m.extend(self.numbers(3 * nodes, 0.02))
            message.body.node_normals.extend(self.numbers(3 * nodes, 1))
            message.body.node_areas_m2.extend(self.numbers(nodes, 1e-5))
        return "description", message.SerializeToString()


def converted(converter, *sent):
    """Returns what is published: the data of each topic's messages."""
    told = {topic: [] for topic in ros2.TOPICS}
    for kind, payload in sent:
        for sample in converter.convert(decode(kind, payload)):
            told[sample.topic].append(sample.data)
    return told

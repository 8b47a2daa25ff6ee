"""Stands in for the parts of ROS 2 that ros2_bridge.py uses, and keeps what they were given. It is no ROS: whether ROS takes
it, no test here knows."""

import enum
import sys
import threading
import types
from unittest import mock


class HistoryPolicy(enum.Enum):
    KEEP_LAST = 1


class ReliabilityPolicy(enum.Enum):
    RELIABLE = 1
    BEST_EFFORT = 2


class DurabilityPolicy(enum.Enum):
    TRANSIENT_LOCAL = 1
    VOLATILE = 2


class QoSProfile:
    def __init__(self, *, history, depth, reliability, durability):
        self.history, self.depth, self.reliability, self.durability = history, depth, reliability, durability


class SignalHandlerOptions(enum.Enum):
    NO = 0
    ALL = 3


class Publisher:
    def __init__(self, kind, qos):
        self.kind, self.qos, self.published = kind, qos, []

    def publish(self, message):
        if type(message) is not bytes:  # as rclpy does
            raise TypeError(f"Expected {self.kind}, got {type(message)}")
        self.published.append(message)


class Node:
    def __init__(self, name):
        self.name, self.publishers, self.services, self.is_destroyed = name, {}, {}, False

    def create_publisher(self, kind, topic, qos):
        self.publishers[topic] = Publisher(kind, qos)
        return self.publishers[topic]

    def create_service(self, kind, name, callback):
        self.services[name] = kind, callback

    def destroy_node(self):
        self.is_destroyed = True


class Ros:
    """What happened. Once installed, `import rclpy` finds it for as long as the context lasts."""

    KINDS = {"geometry_msgs.msg": "WrenchStamped", "sensor_msgs.msg": "PointCloud2", "tf2_msgs.msg": "TFMessage",
             "diagnostic_msgs.msg": "DiagnosticArray", "visualization_msgs.msg": "MarkerArray", "std_srvs.srv": "Trigger"}

    def __init__(self):
        self.arguments, self.signals, self.nodes, self.spun, self.is_running = None, None, [], [], False

    def init(self, *, args, signal_handler_options):
        self.arguments, self.signals, self.is_running = args, signal_handler_options, True

    def create_node(self, name):
        assert self.is_running
        self.nodes.append(Node(name))
        return self.nodes[-1]

    def shutdown(self):
        assert self.is_running
        self.is_running = False

    def executor(self):
        ended = threading.Event()
        return types.SimpleNamespace(add_node=self.spun.append, spin=ended.wait, shutdown=ended.set)

    def installed(self):
        """Returns the context."""
        modules = {
            "rclpy": {"init": self.init, "create_node": self.create_node, "shutdown": self.shutdown},
            "rclpy.qos": {each.__name__: each for each in (HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, QoSProfile)},
            "rclpy.signals": {"SignalHandlerOptions": SignalHandlerOptions},
            "rclpy.executors": {"SingleThreadedExecutor": self.executor},
            **{module: {name: type(name, (), {})} for module, name in self.KINDS.items()},
        }
        made = {}
        for name, content in modules.items():
            made[name.split(".")[0]] = made.get(name.split(".")[0], types.ModuleType(name))
            made[name] = made.get(name, types.ModuleType(name))
            vars(made[name]).update(content)
        return mock.patch.dict(sys.modules, made)

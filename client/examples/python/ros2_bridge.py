"""Publishes the forces of a sensor in ROS 2, or records them as its messages. docs/ros2.md says which message holds what.

usage: ros2_bridge.py [OPTIONS] [INSTANCE] [--ros-args ...]   a node; source ROS 2's setup.bash before
       ros2_bridge.py [OPTIONS] [INSTANCE] --output FILE.mcap   needs no ROS; a file for `ros2 bag play` and Foxglove
"""

import argparse
import functools
import importlib
import json
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Protocol

import traction
from traction import ros2
from traction.ros2.definitions import schema
from traction.ros2.mcap import McapWriter

WAIT_S = 0.2  # after which it looks whether it was asked to end

# Of a recorded QoS profile, by the enumerations in rmw/types.h, in which 0 leaves the choice to the middleware.
UNSPECIFIED = {"sec": 0, "nsec": 0}
KEEP_LAST, RELIABLE, BEST_EFFORT, TRANSIENT_LOCAL, VOLATILE = 1, 1, 2, 1, 2


class Output(Protocol):
    def write(self, sample: ros2.Sample) -> None: ...
    def close(self) -> None: ...


class Node:
    """A node with a publisher for each topic and the service `~/zero`, which runs in a thread of its own."""

    def __init__(self, name: str, control: traction.Control | None, ros_arguments: list[str]) -> None:
        """Without `control` there is no service. Raises ImportError where there is no ROS 2."""
        self._rclpy: Any = importlib.import_module("rclpy")
        qos: Any = importlib.import_module("rclpy.qos")
        reliability, durability = qos.ReliabilityPolicy, qos.DurabilityPolicy
        signals: Any = importlib.import_module("rclpy.signals")
        self._rclpy.init(args=ros_arguments, signal_handler_options=signals.SignalHandlerOptions.NO)
        self._node = self._rclpy.create_node(name)
        self._publishers = {}
        for topic in ros2.TOPICS:
            package, _, message = topic.kind.split("/")
            profile = qos.QoSProfile(
                history=qos.HistoryPolicy.KEEP_LAST, depth=topic.qos.depth,
                reliability=reliability.RELIABLE if topic.qos.is_reliable else reliability.BEST_EFFORT,
                durability=durability.TRANSIENT_LOCAL if topic.qos.is_transient_local else durability.VOLATILE)
            kind = getattr(importlib.import_module(f"{package}.msg"), message)
            self._publishers[topic] = self._node.create_publisher(kind, topic.name, profile)
        if control is not None:
            trigger = importlib.import_module("std_srvs.srv").Trigger
            self._node.create_service(trigger, "~/zero", functools.partial(answer_zero, control))
        self._executor = importlib.import_module("rclpy.executors").SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def write(self, sample: ros2.Sample) -> None:
        self._publishers[sample.topic].publish(sample.data)  # bytes are taken as serialised already

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()
        self._rclpy.shutdown()


def answer_zero(control: traction.Control, _: Any, response: Any) -> Any:
    """Takes a zero, and returns the answer to a std_srvs/Trigger."""
    try:
        taken = control.zero()
        response.success = True
        response.message = taken.remark or f"zero taken of {taken.markers_present} of {taken.markers_expected} markers"
    except traction.Error as error:
        response.success, response.message = False, str(error)
    return response


class File:
    """An MCAP file with ROS 2's profile. It does not replace a file that is there."""

    def __init__(self, path: str, name: str) -> None:
        self._file = open(path, "xb")
        self._writer = McapWriter(self._file, "ros2", f"traction {traction.__version__}")
        # rosbag2 takes the numbers in offered_qos_profiles as such only if the file has this record without the key
        # serialized_metadata.
        self._writer.add_metadata("rosbag2", {"ROS_DISTRO": "unknown"})
        self._channels = {topic: self._writer.add_channel(
            topic.name.replace("~", f"/{name}"), topic.kind, "ros2msg", schema(topic.kind), "cdr",
            {"offered_qos_profiles": offered(topic.qos)}) for topic in ros2.TOPICS}

    def write(self, sample: ros2.Sample) -> None:
        self._writer.write(self._channels[sample.topic], time.time_ns(), sample.stamp_ns, sample.data)

    def close(self) -> None:
        with self._file:
            self._writer.close()


def offered(qos: ros2.Qos) -> str:
    """Returns a list of one profile in YAML, of which JSON is a part."""
    return json.dumps([{
        "history": KEEP_LAST, "depth": qos.depth,
        "reliability": RELIABLE if qos.is_reliable else BEST_EFFORT,
        "durability": TRANSIENT_LOCAL if qos.is_transient_local else VOLATILE,
        "deadline": UNSPECIFIED, "lifespan": UNSPECIFIED, "liveliness": 0, "liveliness_lease_duration": UNSPECIFIED,
        "avoid_ros_namespace_conventions": False}])


def arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="ros2_bridge.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter, usage=argparse.SUPPRESS)
    parser.add_argument("instance", nargs="?", default="default", help="of tractiond on this machine")
    parser.add_argument("--output", metavar="FILE.mcap", help="write this file instead of publishing; it must not exist")
    parser.add_argument("--count", type=int, metavar="N", help="end after N fields")
    parser.add_argument("--stream", metavar="ENDPOINT", default="", help="ZeroMQ's, of the stream, instead of an instance's")
    parser.add_argument("--control", metavar="ENDPOINT", default="", help="ZeroMQ's, for ~/zero; with --stream alone there is none")
    parser.add_argument("--key", metavar="FILE", help="secret key for a gateway, made by tractionctl keys new")
    parser.add_argument("--server-key", metavar="KEY", default="", help="public key of the gateway's machine")
    return parser.parse_args(words)


def run(subscriber: traction.Subscriber, open_output: Callable[[str], Output], count: int | None,
        stop: threading.Event) -> None:
    """Converts what comes until `stop` is set, or until `count` fields have come. The first message names the sensor and so
    the node. Raises traction.Error, OSError, ImportError."""
    converter: ros2.Converter | None = None
    output: Output | None = None
    fields = lost = 0
    try:
        while not stop.is_set() and fields != count:
            try:
                message = subscriber.receive(WAIT_S)
            except traction.Malformed as error:
                print(f"ros2_bridge: a message is left out: {error}", file=sys.stderr)
                continue
            if subscriber.lost > lost:
                print(f"ros2_bridge: {subscriber.lost - lost} messages lost on the way", file=sys.stderr)
                lost = subscriber.lost
            if message is None:
                continue
            sensor = message.header.sensor
            if converter is None or output is None:
                converter = ros2.Converter(sensor)
                output = open_output(converter.node)
            if sensor != converter.sensor:
                raise traction.Error(f"the sensor was '{converter.sensor}' and is now '{sensor}': a node has one; start the "
                                     "bridge anew")
            if isinstance(message, traction.Description) and not message.has_gel:
                print("ros2_bridge: this tractiond has no gel file, and so publishes no forces", file=sys.stderr)
            for sample in converter.convert(message):
                output.write(sample)
            fields += isinstance(message, traction.Field)
    finally:
        if output is not None:
            output.close()


def main(words: list[str]) -> None:
    own = words.index("--ros-args") if "--ros-args" in words else len(words)
    asked = arguments(words[:own])
    if not asked.output:
        importlib.import_module("rclpy")
    keys = traction.load_keys(asked.key, asked.server_key) if asked.key else None
    # An instance of this machine is another sensor than that of a stream elsewhere.
    has_control = asked.control or not asked.stream
    control = traction.Control(asked.instance, endpoint=asked.control, keys=keys) if has_control else None

    def open_output(name: str) -> Output:
        if asked.output:
            return File(asked.output, name)
        return Node(name, control, words[own:])

    stop = threading.Event()

    def end(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, end)
    topics = traction.Topics.FIELD | traction.Topics.DESCRIPTION | traction.Topics.CONTACTS
    with traction.Subscriber(asked.instance, endpoint=asked.stream, keys=keys, topics=topics) as subscriber:
        run(subscriber, open_output, asked.count, stop)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except ImportError as error:
        sys.exit(f"ros2_bridge: {error}: source ROS 2's setup.bash, or write a file: ros2_bridge.py --output FILE.mcap")
    except (traction.Error, OSError) as error:
        sys.exit(f"ros2_bridge: {error}")

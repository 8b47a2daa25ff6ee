"""One grasp through pictures: a twin with a gripper, two daemons, two traction-touch and one for both as a hand, and the
example's controller.

usage: hand.py SCENARIO OPENING_MM JERK FRICTION SEED   prints the outcome as JSON

In lockstep: each pair of pictures waits for a command, and each frame for its solution, up to a second. Run it in a network
namespace of its own, with 127.0.0.1 and 127.0.0.2.
"""

import json
import pathlib
import re
import sys
import threading

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "client" / "python"))
import rig  # noqa: E402
import traction  # noqa: E402

GRAVITY = 9.80665


def grasp(bench, scenario, opening_mm, jerk_m_s2, seed=0):
    """Returns the controller's exit code, what it printed, the true states of the hand, one a frame, and its grasps: what
    was said (traction.Grasp) and the true force and moment."""
    environment = {"XDG_RUNTIME_DIR": str(bench.folder), "PYTHONPATH": str(rig.SOURCE / "client" / "python")}
    commands = f"ipc://{bench.folder / 'commands'}"
    twin = bench.twin(scenario, "--commands", commands, "--lockstep", "--seed", seed)
    sides = {"left": "127.0.0.1", "right": "127.0.0.2"}
    daemons, touches = [], []
    for program in ("tractiond", "traction-touch"):
        (bench.folder / program).mkdir()
    for name, camera in sides.items():
        daemons.append(bench.daemon("[solve]\npatience_ms = 1000\n", instance=name, camera=camera, ready=False))
        (bench.folder / "tractiond" / name).symlink_to(bench.folder / name / "run")  # where a user's instances are
    for name, daemon in zip(sides, daemons):
        daemon.wait_for("zero taken, by itself")
        rig.keep_factors(daemon.state)
        touches.append(bench.start(rig.BIN / "traction-touch", "--instance", name, "--connect", daemon.endpoint["stream"],
                                   "--runtime", bench.folder / "traction-touch" / name))
        touches[-1].wait_for("listening.*ipc")
    hand = bench.start(rig.BIN / "traction-touch", "--hand", rig.SOURCE / "config" / "hand.toml",
                       "--runtime", bench.folder / "traction-touch" / "gripper", env=environment)
    hand.wait_for("listening")
    grasps = Grasps(f"ipc://{bench.folder / 'traction-touch' / 'gripper' / 'stream'}")
    gripper = bench.start(sys.executable, rig.SOURCE / "client/examples/gripper/gripper.py", *sides, commands, opening_mm,
                          jerk_m_s2, env=environment)
    code = gripper.join(600)
    said = grasps.end()
    for process in (hand, *touches, *daemons, twin):
        process.stop()
    with open(twin.truth_file) as lines:
        records = [*map(json.loads, lines)]
    states = [record["hand"] | {"normal_N": record["force_N"][2], "time_s": record["scenario_s"]}
              for record in records if record["finger"] == 0]
    return code, gripper.output(), states, [(grasp, wrench) for grasp in said if (wrench := wrench_at(grasp, records)) is not None]


class Grasps:
    """All valid grasps that come, until the end."""

    def __init__(self, endpoint):
        self.subscriber = traction.Subscriber(endpoint=endpoint, topics=traction.Topics.GRASP)
        self.valid, self.stopping = [], threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.stopping.is_set():
            grasp = self.subscriber.receive(0.1)
            if grasp is not None and grasp.valid:
                self.valid.append(grasp)

    def end(self):
        self.stopping.set()
        self.thread.join()
        self.subscriber.close()
        return self.valid


def wrench_at(grasp, records):
    """The true force and moment at the times of a grasp, in the frame of config/hand.toml; None: they are not recorded. In
    lockstep the camera's clock does not run as the host's, so these times are some frames off."""
    total = np.zeros(6)
    for side, finger in zip((-1, 1), grasp.fingers):
        own = [record for record in records if record["finger"] == (side > 0)]
        near = min(own, key=lambda record: abs(record["monotonic_ns"] - finger.captured_ns))
        if abs(near["monotonic_ns"] - finger.captured_ns) > 1e6 + 2 * finger.captured_error_ns:
            return None
        x, y, z = near["force_N"]
        force = np.array([side * z, side * x, y])  # twin/hand.h
        x, y, z = near["moment_Nm"]
        total += [*force, *(np.array([side * z, side * x, y]) + np.cross([0.022 * side, 0, 0], force))]
    return total


def outcome(states, friction, jerk_m_s2):
    """`held_N`: mean normal force while it is in the air; `least_N`: the least that holds weight and jerk."""
    held = [state for state in states if state["clearance_m"] > 0.03]
    return {"dropped": not held or states[-1]["dropped"] or states[-1]["slid_m"] > 5e-3, "broken": states[-1]["broken"],
            "held_N": float(np.mean([state["normal_N"] for state in held])) if held else 0.0,
            "least_N": states[-1]["mass_kg"] * (GRAVITY + jerk_m_s2) / 2 / friction}


if __name__ == "__main__":
    with rig.Rig() as bench:
        code, said, states, _ = grasp(bench, sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[5]))
    result = outcome(states, float(sys.argv[4]), float(sys.argv[3]))
    print(said)
    print(json.dumps(result | {"code": code, "found": float(re.findall(r"friction ([0-9.]+)", said)[-1])}))

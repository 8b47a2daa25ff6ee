"""One grasp through pictures: a twin with a gripper, two daemons, two traction-touch, and the example's controller.

usage: hand.py SCENARIO OPENING_MM JERK FRICTION SEED   prints the outcome as JSON

In lockstep: each pair of pictures waits for a command, and each frame for its solution, up to a second. Run it in a network
namespace of its own, with 127.0.0.1 and 127.0.0.2.
"""

import json
import re
import sys

import numpy as np
import rig

GRAVITY = 9.80665


def grasp(bench, scenario, opening_mm, jerk_m_s2, seed=0):
    """Returns the controller's exit code, what it printed, and the true states of the hand, one a frame."""
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
    gripper = bench.start(sys.executable, rig.SOURCE / "client/examples/gripper/gripper.py", *sides, commands, opening_mm,
                          jerk_m_s2, env=environment)
    code = gripper.join(600)
    for process in (*touches, *daemons, twin):
        process.stop()
    with open(twin.truth_file) as lines:
        states = [record["hand"] | {"normal_N": record["force_N"][2], "time_s": record["scenario_s"]}
                  for record in map(json.loads, lines) if record["finger"] == 0]
    return code, gripper.output(), states


def outcome(states, friction, jerk_m_s2):
    """`held_N`: mean normal force while it is in the air; `least_N`: the least that holds weight and jerk."""
    held = [state for state in states if state["clearance_m"] > 0.03]
    return {"dropped": not held or states[-1]["dropped"] or states[-1]["slid_m"] > 5e-3, "broken": states[-1]["broken"],
            "held_N": float(np.mean([state["normal_N"] for state in held])) if held else 0.0,
            "least_N": states[-1]["mass_kg"] * (GRAVITY + jerk_m_s2) / 2 / friction}


if __name__ == "__main__":
    with rig.Rig() as bench:
        code, said, states = grasp(bench, sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[5]))
    result = outcome(states, float(sys.argv[4]), float(sys.argv[3]))
    print(said)
    print(json.dumps(result | {"code": code, "found": float(re.findall(r"friction ([0-9.]+)", said)[-1])}))

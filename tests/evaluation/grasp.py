"""Grasps of things of which nothing is known, by the example's controller. Called like the paper's experiments."""

import json
import os
import subprocess
import sys
import tempfile

import numpy as np

import chain
from report import SOURCE

LEAST_N = 100 * chain.GF  # of the grips whose force is held against the target
OWN_NETWORK = ["unshare", "--user", "--map-root-user", "--net", "sh", "-c",
               'ip link set lo up && ip address add 127.0.0.2/8 dev lo && exec "$@"', "sh"]


def through_pictures(count, seed):
    """Each in a network of its own, as the cameras' port is fixed."""
    generator = np.random.default_rng([seed, 6])
    results = []
    for number in range(count):
        friction, mass_g = float(np.exp(generator.uniform(np.log(0.2), 0))), generator.uniform(30, 80)
        width, curvature, jerk = generator.uniform(30, 50), generator.uniform(15, 40), generator.uniform(0, 3)
        least = 1e-3 * mass_g * 9.80665 / 2 / friction
        angle = generator.uniform(0, 2 * np.pi)
        shape = ("ball", f"curvature_mm = {curvature}") if generator.uniform() < 0.6 else (
            "box", f"face_radius_mm = {generator.uniform(2, 6)}\ncurvature_mm = {generator.uniform(5, 15)}")
        scenario = f"""format = 1
[gripper]
opening_mm = {width + 5}
[object]
shape = "{shape[0]}"
{shape[1]}
width_mm = {width}
mass_g = {mass_g}
friction = {friction}
breaking_n = {generator.uniform(3, 5) * least}
[[object.disturbances]]
at_s = {generator.uniform(2, 4)}
duration_s = {generator.uniform(0.1, 0.4)}
acceleration_m_s2 = [{jerk * np.cos(angle)}, {jerk * np.sin(angle)}]
"""
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(scenario)
            file.flush()
            command = [*OWN_NETWORK, sys.executable, SOURCE / "tests/support/hand.py", file.name, width + 5, jerk, friction,
                       number]
            ran = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True,
                                 env={**os.environ, "PYTHONPATH": str(SOURCE / "tests" / "support")})
        result = json.loads(ran.stdout.splitlines()[-1])
        results.append(result | {"friction": friction})
        if result["dropped"] or result["broken"]:
            print(scenario, ran.stdout, flush=True)
    return results


def rows(report, grasps, where):
    dropped, broken, held, least, friction, found = (
        np.array([grasp[key] for grasp in grasps])
        for key in ("dropped", "broken", "held_N", "least_N", "friction", "found"))
    report.row(
        f"{where}: dropped, broken of {len(grasps)}",
        f"{dropped.sum()}, {broken.sum()}",
        "0, 0",
        int(dropped.sum() + broken.sum()),
    )
    firm = least >= LEAST_N
    if firm.any():
        ratio = (held / least)[firm]
        report.row(
            "    normal force over the least that holds weight and jerk: mean, greatest",
            f"{ratio.mean():.2f}, {ratio.max():.2f}",
            "<= 1.3",
            ratio.max(),
        )
        report.row("    friction that was found over the true one: mean, deviation (grips of 100 gf and more)",
                   f"{(found / friction)[firm].mean():.3f}, {(found / friction)[firm].std():.3f}")


def grasp(report, quick):
    report.section(
        "Grasps",
        """
        Things of 30 to 80 g with friction 0.2 to 1, balls and faces with rounded edges, that break at 3 to 5 times the
        least force that holds them; jerks of the hand of up to 3 m/s^2 and bumps as strong. `client/examples/gripper`
        knows nothing of them but the jerk. Without pictures the forces have the noise that those of pictures have.""",
    )
    said = chain.call("grasp", 50 if quick else 1000, report.seed % 2**31)
    rows(report, [json.loads(line) for line in said.splitlines()], "without pictures")
    rows(report, through_pictures(2 if quick else 40, report.seed), "through pictures")

"""The model of contacts in C++ (daemon/solve/model.h), the field alone and around round patches, beside its dense twins
(one_model.py, patches.py) and this build's solver: the same random loads and balls, the same noise, and the time of a
frame.

Called by `tools/evaluate --model --compiled [SEED]`.
"""

import pathlib
import subprocess
import tempfile

import numpy as np

import chain
import one_model
import patches
import shapes
import unseen

FRAMES = 2
TWINS = {"compiled field": "one model", "compiled": "around patches"}


def run(thickness, moved_px, model):
    """What evaluation_model makes of frames x 2M displacements [px], `model` being "field" or "patches": wrench,
    covariance, rounds, atoms, patches, share, solve_ms."""
    with tempfile.TemporaryDirectory(prefix="evaluation-") as name:
        job = pathlib.Path(name)
        np.ascontiguousarray(moved_px, float).tofile(job / "moved_px.f64")
        (job / "gel").write_text(chain.gel_text(thickness))
        subprocess.run(
            [chain.BUILD / "bin/evaluation_model", job, job / "gel", str(shapes.MARKER_NOISE_PX), model], check=True
        )
        files = ("wrench", "covariance", "rounds", "atoms", "patches", "share", "solve_ms")
        return chain.Found({file: np.fromfile(job / f"{file}.f64").reshape(len(moved_px), -1) for file in files})


class Compiled:
    """Runs both and keeps what they say besides wrenches."""

    def __init__(self, thickness):
        self.thickness, self.found = thickness, {}

    def together(self):
        def solver(label, model):
            def solve(moved_px):
                found = self.found[label] = run(self.thickness, moved_px, model)
                return found.wrench, found.covariance.reshape(-1, 6, 6)

            return solve

        return {label: solver(label, model) for label, model in zip(TWINS, ("field", "patches"))}


def say_apart(what, results):
    for label, twin in TWINS.items():
        twin_wrench, twin_covariance = results[twin]
        variance = np.maximum(np.diagonal(twin_covariance, axis1=1, axis2=2), 1e-30)
        apart = (abs(results[label][0] - twin_wrench) / np.sqrt(variance)).max(1)
        middle, high, most = np.quantile(apart, (0.5, 0.95, 1))
        print(
            f"{what}, {label} and its twin apart, in deviations: median {middle:.4f}, 95th percentile {high:.4f}, "
            f"most {most:.3f}",
            flush=True,
        )


def times(label, milliseconds):
    middle, late = np.quantile(milliseconds, (0.5, 0.99))
    print(f"{label:24}: {middle:.2f} ms median, {late:.2f} ms 99th percentile of {len(milliseconds)} frames", flush=True)


def compare(thickness, seed_number, loads):
    compiled = Compiled(thickness)
    drawn, results = one_model.compare(
        thickness, seed_number, loads, FRAMES, patches.others(thickness), compiled.together()
    )
    one_model.say(drawn, results)
    say_apart(f"{thickness} mm", results)
    unit = np.repeat(drawn.displacement, FRAMES, axis=0)
    gel = chain.gel_text(thickness) + unseen.ALL_KNOWN
    now = chain.run(unit, gel=gel, given=shapes.MARKER_NOISE_PX, seed=seed_number % 2**20)
    for zone, kinds in one_model.ZONES.items():
        at = np.repeat(np.isin(drawn.zone, kinds), FRAMES)
        times(f"{zone}, this build's", now.solve_ms[at, 0])
        for label, found in compiled.found.items():
            times(f"{zone}, {label}", found.solve_ms[at, 0])
    found = compiled.found["compiled"]
    print(
        f"compiled: {found.atoms.mean():.0f} atoms, second look in {100 * (found.rounds > 3).mean():.0f} % of the "
        f"frames; patches more likely than not in {100 * (found.share > 0.5).mean():.0f} %",
        flush=True,
    )
    results = patches.say_balls(thickness, seed_number, compiled.together())
    say_apart(f"{thickness} mm, balls", results)
    for label, found in compiled.found.items():
        times(f"balls, {label}", found.solve_ms[:, 0])


def main(seed_number, loads=4):
    print(f"seed {seed_number}; limits as in --only shapes; exact displacements with {shapes.MARKER_NOISE_PX} px of noise")
    for thickness in (15, 40):
        compare(thickness, seed_number, loads)


if __name__ == "__main__":
    one_model.run(main)

"""The model of contacts in C++ (daemon/solve/model.h) beside its dense twin (one_model.py) and this build's solver: the
same random loads, the same noise, and the time of a frame.

Called by `tools/evaluate --model --compiled [SEED]`.
"""

import pathlib
import subprocess
import tempfile

import numpy as np

import chain
import one_model
import shapes
import unseen

FRAMES = 2


def run(thickness, moved_px):
    """What evaluation_model makes of frames x 2M displacements [px]: wrench, covariance, rounds, atoms, solve_ms."""
    with tempfile.TemporaryDirectory(prefix="evaluation-") as name:
        job = pathlib.Path(name)
        np.ascontiguousarray(moved_px, float).tofile(job / "moved_px.f64")
        (job / "gel").write_text(chain.gel_text(thickness))
        subprocess.run(
            [chain.BUILD / "bin/evaluation_model", job, job / "gel", str(shapes.MARKER_NOISE_PX)], check=True
        )
        files = ("wrench", "covariance", "rounds", "atoms", "solve_ms")
        return chain.Found({file: np.fromfile(job / f"{file}.f64").reshape(len(moved_px), -1) for file in files})


def times(label, milliseconds):
    middle, late = np.quantile(milliseconds, (0.5, 0.99))
    print(f"{label:20}: {middle:.2f} ms median, {late:.2f} ms 99th percentile of {len(milliseconds)} frames", flush=True)


def compare(thickness, seed_number, loads):
    drawn, results = one_model.compare(thickness, seed_number, loads, FRAMES)
    twin_wrench, twin_covariance = results["one model"]
    model = one_model.Model(thickness)
    generator = np.random.default_rng([seed_number, thickness, 1])  # the twin's noise once more
    unit = np.repeat(drawn.displacement, FRAMES, axis=0)
    moved = np.array([shapes.pixels(model.markers, each).ravel() for each in unit])
    moved += model.noise * np.array([generator.standard_normal(len(each)) for each in moved])
    found = run(thickness, moved)
    results["compiled model"] = found.wrench, found.covariance.reshape(-1, 6, 6)
    one_model.say(drawn, results)
    deviation = np.sqrt(np.maximum(np.diagonal(twin_covariance, axis1=1, axis2=2), 1e-30))
    apart = abs(found.wrench - twin_wrench) / deviation
    middle, high, most = np.quantile(apart.max(1), (0.5, 0.95, 1))
    print(f"compiled and twin apart, in deviations: median {middle:.4f}, 95th percentile {high:.4f}, most {most:.3f}")
    gel = chain.gel_text(thickness) + unseen.ALL_KNOWN
    now = chain.run(unit, gel=gel, given=shapes.MARKER_NOISE_PX, seed=seed_number % 2**20)
    for zone, kinds in one_model.ZONES.items():
        at = np.repeat(np.isin(drawn.zone, kinds), FRAMES)
        times(f"{zone}, this build's", now.solve_ms[at, 0])
        times(f"{zone}, compiled", found.solve_ms[at, 0])
    again = (found.rounds > 3).mean()
    print(f"compiled: {found.atoms.mean():.0f} atoms, second look in {100 * again:.0f} % of the frames", flush=True)


def main(seed_number, loads=4):
    print(f"seed {seed_number}; limits as in --only shapes; exact displacements with {shapes.MARKER_NOISE_PX} px of noise")
    for thickness in (15, 40):
        compare(thickness, seed_number, loads)


if __name__ == "__main__":
    one_model.run(main)

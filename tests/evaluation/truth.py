"""The true marker displacements of every load of the evaluation: computed by CalculiX, kept compact in data/.

A set is a list of loads of one block. A load is one or more contacts: shape, place, radius, force. Displacements are
those for E = 0.18 MPa, in metres, linear unless the set's name says otherwise; a load scales with 1 / E.
"""

import pathlib
import sys

import numpy as np

import loads

DATA = pathlib.Path(__file__).parent / "data"
SHAPES = ["hertz", "disc"]

PLACES_MM = [(0.7, 0.4), (12, -9), (-30, 0), (0, 28.5), (30, 30), (-33, -33), (20, -33), (33, 6)]
AXES = np.eye(3)


def contact(shape, x_mm, y_mm, radius_mm, force):
    return [SHAPES.index(shape), 1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * radius_mm, *force]


def places(count=8, axes=(0, 1, 2)):
    return [[contact("hertz", *place, 2.5, AXES[axis])] for place in PLACES_MM[:count] for axis in axes]


def random_loads(count):
    generator = np.random.default_rng(20051)
    result = []
    for _ in range(count):
        radius = generator.uniform(1.5, 6)
        x, y = generator.uniform(-33, 33, 2)
        tilt, turn = np.radians(generator.uniform(0, 45)), generator.uniform(0, 2 * np.pi)
        force = [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]
        result.append([contact("hertz" if generator.random() < 0.7 else "disc", x, y, radius, force)])
    return result


def pairs():
    generator = np.random.default_rng(20052)
    result = []
    for distance in (4, 5, 6, 7, 8, 9, 10, 12):
        for _ in range(6):
            centre, turn = generator.uniform(-20, 20, 2), generator.uniform(0, 2 * np.pi)
            half = distance / 2 * np.array([np.cos(turn), np.sin(turn)])
            result.append([contact("hertz", *(centre + side * half), 1.5, AXES[2]) for side in (-1, 1)])
    return result


def catalogue():
    """(thickness [mm], Poisson's ratio): {set: loads}."""
    return {
        (40, 0.49): {
            "probe": [[contact("hertz", 0.7, 0.4, 2.5, axis)] for axis in AXES],
            "places": places(),
            "steps": [[contact("hertz", 1.5 + 3 * k / 8, 1.5, 0, AXES[2])] for k in range(9)],
            "disc": [[contact("disc", *place, 10, axis)] for place in [(0, 0), (12, -9)] for axis in AXES[[2, 0]]],
            "pairs": pairs(),
            "random": random_loads(220),
        },
        (15, 0.49): {"places": places()},
        (25, 0.49): {"places": places()},
        (40, 0.3): {"places": places(5, (0, 2))},
        (40, 0.45): {"places": places(5, (0, 2))},
        (40, 0.4999): {"places": places(5, (0, 2))},
    }


class Set:
    """contacts: loads x contacts x 7 (shape, x, y, radius [m], force); displacement: loads x markers x 3 [m]."""

    def __init__(self, contacts, displacement):
        self.contacts, self.displacement = contacts, displacement

    def forces(self):
        return np.nansum(self.contacts[:, :, 4:7], axis=1)

    def moments(self):
        """About the origin [N m]."""
        x, y, fx, fy, fz = np.moveaxis(self.contacts[:, :, [1, 2, 4, 5, 6]], 2, 0)
        return np.nansum(np.stack([y * fz, -x * fz, x * fy - y * fx], 2), axis=1)


def compute(block, contact_lists):
    longest = max(map(len, contact_lists))
    contacts = np.full((len(contact_lists), longest, 7), np.nan)
    displacement = []
    for row, load in zip(contacts, contact_lists):
        row[: len(load)] = load
        displacement.append(sum(block.displacement(*loads.patch(SHAPES[int(c[0])], c[1:3], c[3], c[4:7])) for c in load))
    return Set(contacts, np.array(displacement))


def name(thickness, poisson, which):
    return f"{thickness}_{poisson}_{which}"


def save(key, computed):
    """16 bits for a displacement: 1 / 65534 of the load's largest is lost."""
    scale = abs(computed.displacement).max(axis=(1, 2)) / 32767
    rounded = np.round(computed.displacement / scale[:, None, None]).astype(np.int16)
    DATA.mkdir(exist_ok=True)
    np.savez_compressed(DATA / f"{key}.npz", contacts=computed.contacts, scale=scale, displacement=rounded)


def load(thickness, poisson, which):
    with np.load(DATA / f"{name(thickness, poisson, which)}.npz") as file:
        return Set(file["contacts"], file["displacement"] * file["scale"][:, None, None])


def main(folder, wanted):
    import calculix

    for (thickness, poisson), sets in catalogue().items():
        if wanted and f"{thickness}_{poisson}" not in wanted:
            continue
        blocks = [calculix.Block(mesh(thickness), poisson, loads.markers(),
                                 folder / f"{mesh.__name__}_{thickness}_{poisson}")
                  for mesh in (calculix.coarse, calculix.fine)]
        worst = 0.0
        for load_list in sets["places"]:
            field = [block.displacement(*loads.patch("hertz", load_list[0][1:3], load_list[0][3], load_list[0][4:7]))
                     for block in blocks]
            red = slice(576, None)
            off = np.linalg.norm(field[0] - field[1], axis=1)[red].max() / np.linalg.norm(field[1], axis=1)[red].max()
            worst = max(worst, off)
        print(f"{thickness} mm, {poisson}: the two meshes differ by at most {100 * worst:.3f} % of the peak", flush=True)
        np.savetxt(DATA / f"{thickness}_{poisson}_mesh_difference.txt", [worst])
        for which, contact_lists in sets.items():
            save(name(thickness, poisson, which), compute(blocks[1], contact_lists))
            print("   ", which, len(contact_lists), flush=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2:])

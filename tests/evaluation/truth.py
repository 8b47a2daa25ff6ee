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
# Of large strain: radius and rounding of the end [mm], whether the gel sticks to it, width of the rings below it [mm]
PROBES = {
    "hemisphere, 4 mm": (2, 2, False, 0.2),
    "hemisphere, 5 mm": (2.5, 2.5, False, 0.25),
    "hemisphere, 5 mm, sticks": (2.5, 2.5, True, 0.25),
    "hemisphere, 8 mm": (4, 4, False, 0.25),
    "hemisphere, 8 mm, sticks": (4, 4, True, 0.25),
    "hemisphere, 20 mm": (10, 10, False, 0.3),
    "flat end, 5 mm": (2.5, 0.5, False, 0.2),
    "flat end, 5 mm, sticks": (2.5, 0.5, True, 0.2),
    "flat end, 10 mm": (5, 0.5, False, 0.25),
}
PROBES_GF = [50, 100, 150, 200, 300, 400, 500, 600, 750]

PLACES_MM = [(0.7, 0.4), (12, -9), (-30, 0), (0, 28.5), (30, 30), (-33, -33), (20, -33), (33, 6)]
AXES = np.eye(3)
LAYER_DEPTHS_MM = [6, 7, 8, 9, 10, 11, 12, 14, 19]
LAYER_FORCE_GF = [0, 2.5, 5]


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


def catalogue():
    """(thickness [mm], Poisson's ratio): {set: loads}."""
    return {
        (40, 0.49): {
            "probe": [[contact("hertz", 0.7, 0.4, 2.5, axis)] for axis in AXES],
            "places": places(),
            "steps": [[contact("hertz", 1.5 + 3 * k / 8, 1.5, 0, AXES[2])] for k in range(9)],
            "disc": [[contact("disc", *place, 10, axis)] for place in [(0, 0), (12, -9)] for axis in AXES[[2, 0]]],
            "random": random_loads(220),
        },
        (15, 0.49): {"places": places()},
        (25, 0.49): {"places": places()},
        (40, 0.3): {"centre": places(1)},
        (40, 0.45): {"centre": places(1)},
        (40, 0.4999): {"centre": places(1)},
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


def quadrature(load):
    """Points and forces of all contacts of a load."""
    parts = [loads.patch(SHAPES[int(c[0])], c[1:3], c[3], c[4:7]) for c in load]
    return np.hstack([part[0] for part in parts]), np.hstack([part[1] for part in parts])


def join(*sets):
    return Set(np.concatenate([one.contacts for one in sets]), np.concatenate([one.displacement for one in sets]))


def as_array(contact_lists):
    contacts = np.full((len(contact_lists), max(map(len, contact_lists)), 7), np.nan)
    for row, load in zip(contacts, contact_lists):
        row[: len(load)] = load
    return contacts


def name(thickness, poisson, which):
    return f"{thickness}_{poisson}_{which}"


def save(key, computed, steps=32767):
    """A displacement is rounded to so many steps from 0 to the load's largest."""
    scale = abs(computed.displacement).max(axis=(1, 2)) / steps
    rounded = np.round(computed.displacement / scale[:, None, None]).astype(np.int16 if steps > 127 else np.int8)
    DATA.mkdir(exist_ok=True)
    np.savez_compressed(DATA / f"{key}.npz", contacts=computed.contacts, scale=scale, displacement=rounded)


def load(thickness, poisson, which):
    with np.load(DATA / f"{name(thickness, poisson, which)}.npz") as file:
        return Set(file["contacts"], file["displacement"] * file["scale"][:, None, None])


def probe(forces):
    """Displacements under the probe, 5 mm across near the centre, for forces (... x 3, N)."""
    return np.tensordot(np.asarray(forces), load(40, 0.49, "probe").displacement, axes=1)


def surface_points():
    """3 x P [m] on the touched surface, within 12 mm of its centre, 1 mm apart."""
    y, x = np.meshgrid(*2 * [1e-3 * np.arange(-12, 13)], indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def surface(folder):
    """A ball of 8 mm pressed with 400 gf at places drawn within one pitch of the centre. What moves: the markers, the
    surface at the nodes, and at surface_points()."""
    import calculix

    ball_radius, force = 4e-3, 400 * 9.80665e-3
    contact_modulus = 1e6 * calculix.Stiffness.YOUNG / (1 - 0.49**2)
    radius_mm = 1e3 * np.cbrt(0.75 * force * ball_radius / contact_modulus)  # Hertz
    places_mm = np.random.default_rng(20059).uniform(-1.5, 1.5, (6, 2))
    contacts = [[contact("hertz", *place, radius_mm, force * AXES[2])] for place in places_mm]
    nodes = np.vstack([loads.nodes(), np.zeros(576)])
    at = np.hstack([loads.markers(), nodes, surface_points()])
    points = [quadrature(one) for one in contacts]
    coarse, fine = (
        calculix.few_loads(mesh, 0.49, at, points, folder / f"surface_{label}")
        for label, mesh in (("coarse", calculix.at_centre(40)), ("fine", calculix.under_ball(40)))
    )
    save(name(40, 0.49, "surface"), Set(as_array(contacts), fine))
    off = np.linalg.norm(coarse - fine, axis=2)[:, 1152:].max() / fine[:, 1152:, 2].max()
    print(f"surface: the two meshes differ by at most {100 * off:.2f} % of the depth", flush=True)


def layers(folder):
    """The paper's figure 6: LAYER_FORCE_GF at each of 10 x 10 nodes, markers at many depths: blue at 6 mm, then red at
    LAYER_DEPTHS, one layer after another."""
    import calculix

    across = np.concatenate([np.arange(0, 15.1, 1.5), np.arange(18, 36.1, 3), [41.5, 47.5, 50]])
    mesh = calculix.Mesh(across, across, [0, 1, 2, 3, 4.5, 6, 7, 8, 9, 10, 11, 12, 14, 16.5, 19, 23, 28, 34, 38, 40])
    blue, red = np.split(loads.markers(), 2, axis=1)
    markers = np.hstack([blue] + [np.vstack([red[:2], np.full(576, 1e-3 * depth)]) for depth in LAYER_DEPTHS_MM])
    x, y = np.meshgrid(3e-3 * (np.arange(10) - 4.5), 3e-3 * (np.arange(10) - 4.5))
    points = np.stack([x.ravel(), y.ravel()])
    force = np.array(LAYER_FORCE_GF) * 9.80665e-3
    moved = calculix.few_loads(mesh, 0.49, markers, [(points, np.outer(force, np.ones(100)))], folder / "layers")
    save(
        name(40, 0.49, "layers"),
        Set(np.array([[contact("hertz", px, py, 0, force) for px, py in 1e3 * points.T]]), moved),
    )
    print("layers", flush=True)


def large_strain(folder):
    """Neo-Hookean, large deformations: presses along z, and shears along x. The difference from the linear solution on
    the same elements is added to the linear truth."""
    import calculix

    young, poisson, newtons_per_gf = calculix.Stiffness.YOUNG, 0.49, 9.80665e-3
    shear_modulus, bulk_modulus = young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)
    elastic = ["*ELASTIC", f"{young},{poisson}"]
    neo_hooke = ["*HYPERELASTIC, NEO HOOKE", f"{shear_modulus / 2},{2 / bulk_modulus}"]
    fine = calculix.Block(calculix.fine(40), poisson, loads.markers(), folder / "fine_40_0.49")
    displacement, contacts = [], []
    cases = {
        "press": ("hertz", 2.5, 2, (50, 200, 400, 750)),
        "wide_press": ("hertz", 7.5, 2, (200, 400, 750)),
        "shear": ("hertz", 2.5, 0, (50, 200, 400)),
    }
    for label, (shape, radius, axis, forces_gf) in cases.items():
        mesh = calculix.for_large_strain(40, half_width=axis == 0)
        parity = (axis != 0, 1)
        listed = [contact(shape, 0, 0, radius, force * newtons_per_gf * AXES[axis]) for force in forces_gf]
        unit = quadrature([contact(shape, 0, 0, radius, AXES[axis])])
        linear_one = calculix.static(
            mesh, parity, elastic, [unit], loads.markers(), folder / "large", f"{label}_linear"
        )[0]
        large = calculix.static(
            mesh,
            parity,
            neo_hooke,
            [quadrature([c]) for c in listed],
            loads.markers(),
            folder / "large",
            label,
            large=True,
        )
        for c, force, moved in zip(listed, forces_gf, large):
            newtons = force * newtons_per_gf
            displacement.append(newtons * fine.displacement(*unit) + moved - newtons * linear_one)
            contacts.append(c)
        print(f"large strain, {label}: {len(large)} of {len(listed)} loads reached", flush=True)
        save(name(40, 0.49, "large"), Set(np.array(contacts)[:, None], np.array(displacement)))


def probes(folder):
    """PROBES pressed in as far as an equilibrium is found: how the markers' displacements differ from those of a linear
    gel under Hertz's pressure on the same circle, for any place: the difference knows little of the block's sides."""
    import indentation
    import influence

    step, depths = 0.25, (6, 8)
    r = step * np.arange(204)
    columns = {"probe": [], "force": [], "depth": [], "radius": [], "difference": []}
    for number, (label, (radius, edge, sticks, rings)) in enumerate(PROBES.items()):
        gel = indentation.gel(rings, max(6, 0.81 * radius))
        found = gel.press(indentation.Rod(radius, edge, sticks), 9.80665e-3 * np.array(PROBES_GF))
        for force_gf, (moved, depth, contact_radius) in zip(PROBES_GF, found):
            less = moved - 9.80665e-3 * force_gf * gel.linear(contact_radius)
            values = [1e-3 * gel.read(less, r, np.full(r.shape, z)).T for z in depths]
            for key, value in zip(columns, (number, 9.80665e-3 * force_gf, depth, contact_radius, values)):
                columns[key].append(value)
        print(f"{label}: up to {PROBES_GF[len(found) - 1]} gf", flush=True)
    difference = np.array(columns.pop("difference"))
    scale = abs(difference).max(axis=(1, 2, 3)) / 32767
    rounded = np.round(difference / scale[:, None, None, None]).astype(np.int16)
    file = DATA / f"{name(40, 0.49, 'probes')}.npz"
    np.savez_compressed(file, step=1e-3 * step, scale=scale, difference=rounded, **columns)

    large = load(40, 0.49, "large")
    gel = indentation.gel(0.3, 8.1)
    for (_, _, _, radius, *_, force), moved in zip(large.contacts[:, 0], large.displacement):
        if radius > 5e-3:
            linear = influence.of(40).displacement(*loads.patch("hertz", (0, 0), radius, force * AXES[2]))
            mine = gel.under_pressure(1e3 * radius, force)
            if mine is None:
                print(f"a pressure of {force:.2f} N: no equilibrium", flush=True)
                continue
            x, y, z = 1e3 * loads.markers()
            mine = 1e-3 * gel.read(mine - force * gel.linear(1e3 * radius), np.hypot(x, y), z)[1]
            off = abs(mine - (moved - linear)[:, 2]).max() / abs(moved - linear).max()
            print(f"a pressure of {force:.2f} N: {100 * off:.1f} % of what is not linear from CalculiX", flush=True)


class Probes:
    """What probes() has kept; a row a load."""

    def __init__(self):
        with np.load(DATA / f"{name(40, 0.49, 'probes')}.npz") as file:
            self.step, self.force, self.radius_mm = (file[key] for key in ("step", "force", "radius"))
            self.difference = file["difference"] * file["scale"][:, None, None, None]

    def at(self, place):
        """As a Set of presses at a place [m]."""
        import influence

        x, y, z = loads.markers() - np.array([[*place, 0]]).T
        r, layer = np.maximum(np.hypot(x, y), 1e-9), np.digitize(z, [7e-3])
        grid, displacement, contacts = self.step * np.arange(self.difference.shape[2]), [], []
        for force, radius, difference in zip(self.force, self.radius_mm, self.difference):
            along, down = (
                np.where(layer == 0, *[np.interp(r, grid, one[:, c]) for one in difference]) for c in (0, 1)
            )
            patch = loads.patch("hertz", place, 1e-3 * radius, force * AXES[2])
            linear = influence.of(40).displacement(*patch)
            displacement.append(linear + np.stack([along * x / r, along * y / r, down], 1))
            contacts.append([contact("hertz", *(1e3 * np.array(place)), radius, force * AXES[2])])
        return Set(np.array(contacts), np.array(displacement))


def expansion(folder):
    """1 K: silicone's linear expansion of 3e-4 / K on a window that stays."""
    import calculix

    material = ["*ELASTIC", f"{calculix.Stiffness.YOUNG},0.49", "*EXPANSION", "3e-4"]
    moved = calculix.static(
        calculix.coarse(40),
        (1, 1),
        material,
        [(None, None)],
        loads.markers(),
        folder / "expansion",
        "block",
        extra=["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0.0"],
    )
    save(name(40, 0.49, "expansion"), Set(np.array([[contact("hertz", 0, 0, 1, [0, 0, 0])]]), moved))
    print("expansion", flush=True)


def strayed(folder):
    """What a block of slightly other mechanics does otherwise under the random loads, and after them under the
    probe: derivatives of the displacements, by differences, in 31 steps: sets strayed_poisson [m], strayed_thickness
    and strayed_depth [m/m]. The last one is by each marker's own depth."""
    import calculix

    markers, step = loads.markers(), 0.5e-3
    straight = join(load(40, 0.49, "random"), load(40, 0.49, "probe"))
    points = [quadrature(one) for one in straight.contacts]

    def moved(label, poisson=0.49, markers=markers, mesh=calculix.fine(40)):
        return calculix.few_loads(mesh, poisson, markers, points, folder / label)

    def keep(label, derivative):
        save(name(40, 0.49, f"strayed_{label}"), Set(straight.contacts, derivative), 31)
        print(f"strayed {label}", flush=True)

    keep("poisson", (straight.displacement - moved("poisson", poisson=0.485)) / 0.005)
    keep("thickness", (moved("thickness", mesh=calculix.thicker(40, 1e3 * step)) - straight.displacement) / step)
    sides = [markers + [[0], [0], [side * step]] for side in (-1, 1)]
    both = moved("depth", markers=np.hstack(sides), mesh=calculix.around_markers(40, 1e3 * step))
    keep("depth", (both[:, markers.shape[1] :] - both[:, : markers.shape[1]]) / (2 * step))


def linear(thickness, poisson, sets, folder):
    """Prints and keeps how much two meshes differ, at the markers that are nodes of both (the red ones)."""
    import calculix

    where = f"{thickness}_{poisson}"
    many = sum(map(len, sets.values())) > 100
    meshes = [calculix.coarse(thickness), calculix.fine(thickness)]
    if "centre" in sets:  # loads at the centre alone
        meshes = [calculix.around_centre(thickness), calculix.at_centre(thickness)]
    worst = 0.0
    for which, contact_lists in sets.items():
        points = [quadrature(load) for load in contact_lists]
        fields = []
        for size, mesh in zip(("coarse", "fine"), meshes):
            at = folder / f"{size}_{where}"
            if many:
                block = calculix.Block(mesh, poisson, loads.markers(), at)
                fields.append(np.array([block.displacement(*load) for load in points]))
            else:
                fields.append(calculix.few_loads(mesh, poisson, loads.markers(), points, at))
        if which in ("places", "centre"):
            off, size = (np.linalg.norm(field, axis=2)[:, 576:].max(1) for field in (fields[0] - fields[1], fields[1]))
            worst = max(worst, (off / size).max())
            np.savetxt(DATA / f"{where}_mesh_difference.txt", [worst], "%.6f")
        save(name(thickness, poisson, which), Set(as_array(contact_lists), fields[1]))
        print(f"{thickness} mm, {poisson}, {which}: {len(points)} loads", flush=True)
    print(f"    the two meshes differ by at most {100 * worst:.3f} % of the peak", flush=True)


def main(folder, wanted):
    for part in (expansion, surface, layers, large_strain, probes):
        if not wanted or part.__name__ in wanted:
            part(folder)
    for (thickness, poisson), sets in catalogue().items():
        if not wanted or f"{thickness}_{poisson}" in wanted:
            linear(thickness, poisson, sets, folder)
    if not wanted or "strayed" in wanted:
        strayed(folder)
    if not wanted or "friction" in wanted:
        import friction

        friction.main(folder)
    if not wanted or "bodies" in wanted:
        import fingertip

        fingertip.main(folder)
    if not wanted or "influence" in wanted:
        import influence

        influence.main(folder)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2:])

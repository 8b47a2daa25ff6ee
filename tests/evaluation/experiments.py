"""The experiments. Each takes the report and whether to be quick (fewer trials); truth.py has the loads.

Errors are root mean squares over trials unless they are called the worst. A trial has its own noise and its own zero.
"""

import numpy as np

import chain
import loads
import truth
from chain import GF

UNEXPLAINED, OUT_OF_RANGE = 1 << 5, 1 << 6  # of the field's flags
PAPER_NOISE_PX = 0.1  # of the paper's tracking; what the pictures have themselves is negligible beside it


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def angle_deg(vectors):
    """From the normal, of ... x 3."""
    return np.degrees(np.arctan2(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2]))


def field(which, index, thickness=40, poisson=0.49):
    """Marker displacement [m] of 1 N, and its force and moment."""
    loads_of = truth.load(thickness, poisson, which)
    return loads_of.displacement[index], loads_of.forces()[index], loads_of.moments()[index]


def probe(forces):
    """Displacements under the probe, 5 mm across near the centre, for forces (... x 3, N)."""
    return np.tensordot(np.asarray(forces), truth.load(40, 0.49, "probe").displacement, axes=1)


# The paper's figures 7a, 7b


def magnitude(report, quick):
    report.section(
        "Magnitude (the paper's figure 7a)",
        """
        A probe of 5 mm diameter presses near the centre, 0 to 750 gf in steps of 50 gf, 10 trials, single frames.""",
    )
    applied = np.arange(0, 751, 50)
    trials = 10
    forces = np.zeros((trials, len(applied), 3))
    forces[:, :, 2] = applied * GF
    displacement = probe(forces.reshape(-1, 3))
    lines, drawn = [], {}
    for label, extra in (("pictures", 0.0), ("0.1 px of noise", PAPER_NOISE_PX)):
        found = chain.run(displacement, zero_every=len(applied), extra=extra)
        total = found.resultant_N.reshape(trials, len(applied), 3) / GF
        error = np.linalg.norm(total, axis=2) * np.sign(total[:, :, 2]) - applied
        error[:, 0] = total[:, 0, 2]
        step = rms(error, 0)
        worst = np.argmax(step / (3 + 0.01 * applied))
        drawn[label] = total[:, :, 2]
        lines.append((label, *[f"{value:.1f}" for value in step[[0, 1, 2, 4, 8, 15]]]))
        judged = label == "pictures"
        report.row(
            f"magnitude error, 0 - 750 gf, {label}",
            f"{rms(error):.1f} gf",
            "30 gf",
            "<= 3 gf + 1 %" if judged else "",
            *(1, step[worst] / (3 + 0.01 * applied[worst])) if judged else (),
            name="magnitude",
        )
        report.row(
            "    worst step", f"{step[worst]:.1f} gf at {applied[worst]} gf, mean off {error[:, worst].mean():+.1f}"
        )
    report.table(["error [gf] at", "0 gf", "50", "100", "200", "400", "750"], lines)

    def draw(axes):
        axes.plot([0, 750], [0, 750], "k-", lw=0.5)
        for mark, (label, values) in zip("x+", drawn.items()):
            axes.plot(np.tile(applied, trials) + (6 if mark == "+" else -6), values.ravel(), mark, ms=4, label=label)
        axes.set(xlabel="applied normal force [gf]", ylabel="measured [gf]")
        axes.legend()

    report.picture("magnitude", draw, "Figure 7a: ten trials a step. The paper's resolution is about 30 gf.")


def direction(report, quick):
    report.section(
        "Direction (the paper's figure 7b)",
        """
        The same probe with 400 gf, 0 to 45 degrees from the normal in steps of 5, 10 trials, single frames.""",
    )
    applied = np.arange(0, 46, 5)
    trials = 10
    radians = np.radians(np.tile(applied, (trials, 1)))
    forces = 400 * GF * np.stack([np.sin(radians), 0 * radians, np.cos(radians)], 2)
    displacement = probe(forces.reshape(-1, 3))
    drawn = {}
    for label, extra in (("pictures", 0.0), ("0.1 px of noise", PAPER_NOISE_PX)):
        found = chain.run(displacement, zero_every=len(applied), extra=extra)
        total = found.resultant_N.reshape(trials, len(applied), 3)
        cosine = (total * forces).sum(2) / np.linalg.norm(total, axis=2) / np.linalg.norm(forces, axis=2)
        error = np.degrees(np.arccos(np.minimum(cosine, 1)))
        step = rms(error, 0)
        worst = np.argmax(step)
        drawn[label] = angle_deg(total)
        judged = label == "pictures"
        report.row(
            f"direction error, 0 - 45 deg at 400 gf, {label}",
            f"{rms(error):.2f} deg",
            "5 deg",
            "<= 0.4 deg" if judged else "",
            *(0.4, rms(error)) if judged else (),
            name="direction",
        )
        report.row("    worst step", f"{step[worst]:.2f} deg at {applied[worst]} deg")

    def draw(axes):
        axes.plot([0, 45], [0, 45], "k-", lw=0.5)
        for mark, (label, values) in zip("x+", drawn.items()):
            axes.plot(
                np.tile(applied, trials) + (0.3 if mark == "+" else -0.3), values.ravel(), mark, ms=4, label=label
            )
        axes.set(xlabel="applied angle [deg]", ylabel="measured [deg]")
        axes.legend()

    report.picture("direction", draw, "Figure 7b: ten trials a step. The paper's resolution is about 5 degrees.")


# The paper's figure 6


def separation(report, quick):
    try:
        truth_of = truth.load(40, 0.49, "layers")
    except FileNotFoundError:
        return
    report.section(
        "Distance between the marker layers (the paper's figure 6)",
        """
        The paper's load, the same force at each of 10 x 10 nodes, mostly normal with half of it along y; mean
        difference of the 576 node forces from the truth, relative to that of a single layer of markers. Displacements
        are given with noise, not drawn. The paper has no noise and its own model as the truth; its optimum is at 2 or
        3 mm.""",
    )
    true = np.zeros((576, 3))
    for one in truth_of.contacts[0]:
        true[np.argmin(np.linalg.norm(loads.nodes() - one[1:3, None], axis=0))] = one[4:7]
    field_of = truth_of.displacement[0].reshape(-1, 576, 3)
    frames = 10 if quick else 40
    distances = [depth - 6 for depth in truth.LAYER_DEPTHS_MM]
    curves, lines = {}, []
    for noise in (0.02, PAPER_NOISE_PX):
        errors = []
        for depth in [None, *truth.LAYER_DEPTHS_MM]:
            text = chain.gel_text(red_depth=depth or 8)
            if depth is None:  # the blue layer alone
                text = text[: text.index('[[layers]]\ncolour = "red"')] + text[text.index("[camera]") :]
            shown = [field_of[0]] if depth is None else [field_of[0], field_of[1 + truth.LAYER_DEPTHS_MM.index(depth)]]
            found = chain.run(np.repeat(np.concatenate(shown)[None], frames, axis=0), gel=text, given=noise)
            errors.append(abs(found.force_N.reshape(frames, 576, 3) - true).mean((0, 1)))
        errors = np.array(errors)
        curves[noise] = errors / errors[0]
        lines += [
            (f"{noise} px, {axis}", *[f"{value:.2f}" for value in errors[1:, c] / errors[0, c]])
            for c, axis in enumerate(("Fx", "Fy", "Fz"))
        ]
        best = distances[int(np.argmin(errors[1:].sum(1)))]
        report.row(f"best distance between the layers, {noise} px of noise", f"{best} mm", "2 - 3 mm")
    report.table(["noise, component", *[f"{distance} mm" for distance in distances]], lines)

    def draw(axes):
        for (noise, values), style in zip(curves.items(), ("-", "--")):
            for c, axis in enumerate(("Fx", "Fy", "Fz")):
                axes.plot(distances, values[1:, c], style + "o", ms=3, color=f"C{c}", label=f"{axis}, {noise} px")
        axes.set(xlabel="distance between the layers [mm]", ylabel="mean difference / of one layer")
        axes.legend(fontsize=7)

    report.picture(
        "separation", draw, "Figure 6: error over the distance of the layers; 1 is a single layer of blue markers."
    )


# Mechanics


def mechanics(report, quick):
    report.section(
        "The block's mechanics against CalculiX",
        """
        Largest distance between the markers' displacements of the two programs in parts of the largest displacement
        under the same load. CalculiX's own error is estimated by a mesh twice as coarse, at the markers that are
        nodes of both: the difference, of which the finer mesh has a quarter or less.""",
    )
    worst_of_all = 0.0
    for poisson in (0.49, 0.4999) if quick else (0.3, 0.45, 0.49, 0.4999):
        try:
            places = truth.load(40, poisson, "places" if poisson == 0.49 else "centre")
        except FileNotFoundError:
            continue
        ours = chain.mechanics(chain.gel_text(poisson=poisson), force_rows(places))
        off = np.linalg.norm(ours - places.displacement, axis=2).max(1)
        worst = (off / np.linalg.norm(places.displacement, axis=2).max(1)).max()
        worst_of_all = max(worst, worst_of_all)
        report.row(
            f"block of 40 mm, Poisson's ratio {poisson}, {len(off)} loads",
            f"{100 * worst:.2f} % of the peak (meshes {100 * mesh_difference(40, poisson):.2f} %)",
        )
    report.row(
        "marker displacement of the block against CalculiX, largest",
        f"{100 * worst_of_all:.2f} % of the peak",
        "–",
        "<= 0.7 %",
        0.007,
        worst_of_all,
        name="mechanics",
    )
    for thickness in () if quick else (15, 25):
        try:
            places = truth.load(thickness, 0.49, "places")
        except FileNotFoundError:
            continue
        ours = chain.mechanics(chain.gel_text(thickness), force_rows(places))
        off = np.linalg.norm(ours - places.displacement, axis=2).max(1)
        worst = (off / np.linalg.norm(places.displacement, axis=2).max(1)).max()
        report.row(
            f"block of {thickness} mm, Poisson's ratio 0.49",
            f"{100 * worst:.2f} % of the peak " f"(meshes {100 * mesh_difference(thickness, 0.49):.2f} %)",
        )


def mesh_difference(thickness, poisson):
    return float(np.loadtxt(truth.DATA / f"{thickness}_{poisson}_mesh_difference.txt"))


def force_rows(load_set):
    rows = []
    for number, contacts in enumerate(load_set.contacts):
        for contact in contacts[~np.isnan(contacts[:, 0])]:
            points, forces = loads.patch(truth.SHAPES[int(contact[0])], contact[1:3], contact[3], contact[4:7])
            rows.append(np.column_stack([np.full(points.shape[1], number), points.T, forces.T]))
    return np.concatenate(rows)


def bias(report, quick):
    report.section(
        "Bias of the resultant",
        """
        Mean over frames of the resultant less the truth, its length, for Hertz pressures of 5 mm diameter at eight
        places (near the centre, off it, near sides and in corners), along x, y and z, 5 to 400 gf; for 40 mm besides
        even discs of 20 mm diameter and 20 random loads. The inverse alone is given the exact displacements.""",
    )
    frames = 10 if quick else 200  # the limit is half of one frame's deviation, and means are to be far below it
    for thickness in (15, 40):
        try:
            sets = [truth.load(thickness, 0.49, "places")]
        except FileNotFoundError:
            continue
        if thickness == 40:
            sets += [truth.load(40, 0.49, "disc"), truth.load(40, 0.49, "random")]
            sets[2] = truth.Set(sets[2].contacts[:20], sets[2].displacement[:20])
        unit = np.concatenate([one.displacement for one in sets])
        forces = np.concatenate([one.forces() for one in sets])
        contacts = np.concatenate([one.contacts[:, 0] for one in sets])
        listed, alone, noise = [], [], 0.0
        for magnitude_gf in (5, 50, 400):
            limit = max(1, 0.015 * magnitude_gf)
            exact = chain.run(magnitude_gf * GF * unit, gel=chain.gel_text(thickness), given=0).resultant_N / GF
            alone += list(np.linalg.norm(exact - magnitude_gf * forces, axis=1) / limit)
            displacement = np.repeat(magnitude_gf * GF * unit, frames, axis=0)
            found = chain.run(displacement, gel=chain.gel_text(thickness), zero_every=5)
            total = found.resultant_N.reshape(len(unit), frames, 3) / GF
            mean = total.mean(1)
            noise = max(noise, rms(np.linalg.norm(total.std(1), axis=1)) / np.sqrt(frames))
            for measured, force, contact in zip(mean, magnitude_gf * forces, contacts):
                off = np.linalg.norm(measured - force)
                listed.append((off / limit, off, magnitude_gf, contact, force, measured))
        listed.sort(key=lambda one: -one[0])
        worst, off, magnitude_gf, *_ = listed[0]
        report.row(
            f"bias of the resultant, {thickness} mm, {len(listed)} loads; worst",
            f"{off:.1f} gf of {magnitude_gf} gf",
            "unknown",
            "max(1 gf, 1.5 %)",
            1,
            worst,
            name=f"bias {thickness} mm",
        )
        report.row("    loads beyond it", f"{sum(one[0] > 1 for one in listed)} of {len(listed)}")
        report.row("    noise that is left in these means", f"{noise:.1f} gf")
        report.row("    beyond it by the inverse alone", f"{sum(np.array(alone) > 1)} of {len(alone)}")
        report.table(
            ["load", "at [mm]", "force [gf]", "measured [gf]", "off [gf]"],
            [
                (
                    f"{truth.SHAPES[int(contact[0])]}, {2e3 * contact[3]:.0f} mm across",
                    f"{1e3 * contact[1]:.0f}, {1e3 * contact[2]:.0f}",
                    ", ".join(f"{value:.0f}" for value in force),
                    ", ".join(f"{value:.1f}" for value in measured),
                    f"{off:.1f}",
                )
                for _, off, _, contact, force, measured in listed[:5]
            ],
        )


def models(report, quick):
    report.section(
        "Resultant by model",
        """
        200 gf as Hertz pressures of 5 mm diameter at eight places along x, y and z; single frames. Error: length of
        the difference of the resultants, root mean square over the places.""",
    )
    lines = []
    for thickness in (15, 40) if quick else (15, 25, 40):
        try:
            places = truth.load(thickness, 0.49, "places")
        except FileNotFoundError:
            continue
        forces = 200 * places.forces()
        for model, solve in (("half-space", 'model = "half-space"'), ("block", "")):
            found = chain.run(200 * GF * places.displacement, gel=chain.gel_text(thickness), solve=solve)
            error = np.linalg.norm(found.resultant_N / GF - forces, axis=1).reshape(-1, 3)
            lines.append(
                (
                    f"{thickness} mm, {model}",
                    f"{rms(error[:, 2]) / 2:.1f} %",
                    f"{error[:, 2].max() / 2:.1f} %",
                    f"{rms(error[:, :2]) / 2:.1f} %",
                    f"{error[:, :2].max() / 2:.1f} %",
                )
            )
    report.table(["gel, model", "press", "worst", "shear", "worst"], lines)


# Space


def point_load(report, quick):
    report.section(
        "Response to a point load (the paper's figure 8)",
        """
        200 gf at a point, at nine places between two neighbouring nodes; the normal forces of the nodes in its row
        over their distance from it, mean of 10 frames.""",
    )
    steps = truth.load(40, 0.49, "steps")
    frames = 10
    drawn = {}
    x = 1e3 * loads.nodes()[0].reshape(24, 24)[12]
    for label, extra in (("pictures", 0.0), ("0.1 px of noise", PAPER_NOISE_PX)):
        found = chain.run(np.repeat(200 * GF * steps.displacement, frames, axis=0), extra=extra)
        normal = found.force_N.reshape(-1, frames, 24, 24, 3).mean(1)[:, 12, :, 2] / GF
        offset = x[None, :] - 1e3 * steps.contacts[:, 0, 1][:, None]
        order = np.argsort(offset.ravel())
        offset, normal = offset.ravel()[order], normal.ravel()[order]
        smooth = np.convolve(np.pad(normal, 2, mode="edge"), np.ones(5) / 5, "valid")
        above = offset[smooth >= smooth.max() / 2]
        half = (above.max() - above.min()) / 2
        drawn[label] = (offset, normal / normal.max())
        judged = label == "pictures"
        report.row(
            f"half-width of a point load, {label}",
            f"{half:.2f} mm",
            "4 mm",
            "<= 2.5 mm" if judged else "",
            *(2.5, half) if judged else (),
            name="half-width",
        )

    def draw(axes):
        for mark, (label, (offset, normal)) in zip(".x", drawn.items()):
            axes.plot(offset, normal, mark, ms=4, label=label)
        axes.set(xlim=(-15, 15), xlabel="distance from the load [mm]", ylabel="normal force of a node / largest")
        axes.legend()

    report.picture("point_load", draw, "Figure 8: the paper's half-width is about 4 mm.")


def flat_disc(report, quick):
    report.section(
        "Pressure of a flat disc", "Even pressure on a disc of radius 10 mm, 400 gf, single frames, 10 trials."
    )
    disc = truth.load(40, 0.49, "disc")
    trials = 10
    found = chain.run(np.repeat(400 * GF * disc.displacement[::2], trials, axis=0), zero_every=1)
    pressure = found.force_N.reshape(2, trials, 576, 3)[..., 2] / 9e-6
    true = 400 * GF / (np.pi * 0.01**2)
    inside, outside = [], []
    for place, contacts in zip(pressure, disc.contacts[::2]):
        radius = np.linalg.norm(loads.nodes() - contacts[0, 1:3, None], axis=0)
        inside.append(place[:, radius < 7e-3] / true - 1)
        outside.append(place[:, radius > 13e-3] / true)
    off = rms(np.concatenate(inside, axis=1))
    report.row(
        "pressure of a flat disc, more than 3 mm within its edge, RMS",
        f"{100 * off:.0f} %",
        "–",
        "<= 15 %",
        0.15,
        off,
        name="disc",
    )
    report.row("    more than 3 mm outside", f"{100 * rms(np.concatenate(outside, axis=1)):.1f} % of it")

    def draw(axes):
        radius = 1e3 * np.linalg.norm(loads.nodes() - disc.contacts[0, 0, 1:3, None], axis=0)
        axes.plot(np.tile(radius, (trials, 1)).ravel(), 1e-3 * pressure[0].ravel(), ".", ms=2)
        axes.plot([0, 10, 10, 25], [1e-3 * true, 1e-3 * true, 0, 0], "k-", lw=0.8)
        axes.set(xlim=(0, 25), xlabel="distance from the disc's centre [mm]", ylabel="pressure [kPa]")

    report.picture("disc", draw, "Pressure of each node in ten frames; the line is the truth.")


def two_contacts(report, quick):
    report.section(
        "Two contacts told apart",
        """
        Two presses of 100 gf, 3 mm across, at six places and in six directions for each distance: told apart when
        there are two contacts, each within 1 mm and 10 %. False splits: a single press of 100 gf that is called two.""",
    )
    pairs = truth.load(40, 0.49, "pairs")
    trials = 10 if quick else 30
    found = chain.run(np.repeat(100 * GF * pairs.displacement, trials, axis=0), zero_every=trials)
    if "contacts" not in found:
        report.row(
            "two contacts of 100 gf told apart", "no list of contacts", "–", "<= 8 mm", 8, np.inf, name="two contacts"
        )
        return
    distance = 1e3 * np.linalg.norm(pairs.contacts[:, 0, 1:3] - pairs.contacts[:, 1, 1:3], axis=1)
    good = np.zeros(len(found.contacts_found))
    for frame, listed in enumerate(found.contacts_found):
        true = pairs.contacts[frame // trials][:, 1:3]
        if len(listed) != 2:
            continue
        orders = [listed, listed[::-1]]
        good[frame] = any(
            (np.linalg.norm(order[:, :2] - true, axis=1) < 1e-3).all()
            and (abs(np.linalg.norm(order[:, 4:7], axis=1) / (100 * GF) - 1) < 0.1).all()
            for order in orders
        )
    good = good.reshape(len(pairs.contacts), trials).mean(1)
    counts = found["contact_count"].reshape(len(pairs.contacts), trials)
    rounded = distance.round().astype(int)
    at = sorted(set(rounded))
    share = {d: good[rounded == d].mean() for d in at}
    report.table(
        ["distance [mm]", "told apart", "two listed"],
        [(str(d), f"{100 * share[d]:.0f} %", f"{100 * (counts[rounded == d] == 2).mean():.0f} %") for d in at],
    )
    smallest = min([d for d in at if all(share[e] >= 0.95 for e in at if e >= d)], default=np.inf)
    report.row(
        "two contacts of 100 gf told apart from", f"{smallest} mm", "–", "<= 8 mm", 8, smallest, name="two contacts"
    )
    places = truth.load(40, 0.49, "places")
    single = chain.run(np.repeat(100 * GF * places.displacement[2::3], 5 * trials, axis=0), zero_every=trials)
    split = (single["contact_count"] > 1).mean()
    report.row(
        "    false splits of a single press of 100 gf",
        f"{100 * split:.2f} % of {len(single.valid)}",
        "–",
        "<= 1 %",
        0.01,
        split,
        name="false splits",
    )


def detection(report, quick):
    report.section(
        "Smallest press",
        """
        A press of 5 mm diameter at eight places: found, when a contact is listed; a false alarm is a contact in a
        frame in which nothing touches.""",
    )
    places = truth.load(40, 0.49, "places")
    unit = places.displacement[2::3]
    trials = 20 if quick else 60
    idle = chain.run(np.zeros((600 if quick else 2000, *unit.shape[1:])), zero_every=25)
    has_list = "contact_count" in idle
    threshold = np.quantile(idle.resultant_N[:, 2], 0.99)
    alarm = (idle["contact_count"] > 0).mean() if has_list else 0.01
    report.row(
        "frames with a false alarm" + ("" if has_list else " (threshold on the normal force)"),
        f"{100 * alarm:.2f} %",
        "–",
        "<= 1 %",
        0.01,
        alarm,
        name="false alarms",
    )
    smallest, lines = np.inf, []
    for force in (1, 2, 3, 4, 5, 7, 10, 15, 20, 30):
        found = chain.run(np.repeat(force * GF * unit, trials, axis=0), zero_every=trials // 4)
        seen = found["contact_count"] > 0 if has_list else found.resultant_N[:, 2] > threshold
        share = seen.mean()
        lines.append((f"{force} gf", f"{100 * share:.0f} %"))
        smallest = min(smallest, force) if share >= 0.95 else np.inf
        if share >= 0.999:
            break
    report.table(["press", "found"], lines)
    report.row(
        "smallest press found in 95 % of frames", f"{smallest} gf", "–", "<= 5 gf", 5, smallest, name="detection"
    )


# Uncertainty


def coverage(report, quick):
    report.section(
        "What the stated uncertainty covers",
        """
        Random loads (place, radius 1.5 to 6 mm, up to 45 degrees from the normal, 5 to 400 gf), 10 frames each. For
        each load the gel's true stiffness, the camera's true pose and focal length and the picture's motion are drawn
        from the standard deviations that the gel file states; the daemon does not know them. Covered: the truth lies
        within 1.96 stated deviations.""",
    )
    generator = np.random.default_rng(20053)
    random = truth.load(40, 0.49, "random")
    count, frames = (40 if quick else 200), 10
    groups = 10 if quick else 40  # of loads that share a camera pose
    results, deviations, errors = [], [], []
    for group in range(groups):
        chosen = range(group * count // groups, (group + 1) * count // groups)
        pose = [0, 0, 157] + 0.3 * generator.standard_normal(3)
        rotation = 0.002 * generator.standard_normal(3)
        focal = 960 * (1 + 0.002 * generator.standard_normal())
        displacement, stray, true = [], [], []
        for index in chosen:
            force = np.exp(generator.uniform(np.log(5), np.log(400))) * GF
            stiffness = 1 + 0.02 * generator.standard_normal()
            displacement.append(np.repeat(force / stiffness * random.displacement[index][None], frames, axis=0))
            drift = generator.standard_normal(4) * [0.02, 0.02, 1e-4, 1e-4]
            stray.append(np.tile([*drift, 1.0], (frames, 1)))
            true.append(np.concatenate([force * random.forces()[index], force * random.moments()[index]]))
        found = chain.run(
            np.concatenate(displacement),
            twin_gel=chain.gel_text(position=pose, rotation=rotation, focal=focal),
            stray=np.concatenate(stray),
            zero_every=frames,
            seed=group + 1,
        )
        if "noise_covariance" not in found:
            report.row(
                "truth inside the stated 95 % interval",
                "no covariance",
                "–",
                "92 - 98 %",
                0.98,
                np.inf,
                0.92,
                name="coverage",
            )
            return
        covariance = (found["noise_covariance"] + found["systematic_covariance"]).reshape(-1, 6, 6)
        deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))
        error = np.hstack([found.resultant_N, found.moment_Nm]) - np.repeat(true, frames, axis=0)
        results.append(abs(error) <= 1.96 * deviation)
        deviations.append(deviation)
        errors.append(error)
    inside, deviation, error = np.concatenate(results), np.concatenate(deviations), np.concatenate(errors)
    for axis, label in enumerate(("Fx", "Fy", "Fz", "Mx", "My", "Mz")):
        width, unit = (
            (2 * 1.96 * np.median(deviation[:, axis]) / GF, "gf")
            if axis < 3
            else (2 * 1.96 * np.median(deviation[:, axis]) / GF * 1e3, "gf mm")
        )
        share = inside[:, axis].mean()
        report.row(
            f"truth inside the stated 95 % interval, {label}",
            f"{100 * share:.1f} %, median width {width:.1f} {unit}",
            "–",
            "92 - 98 %",
            0.98,
            share,
            0.92,
            name=f"coverage {label}",
        )


def missing(report, quick):
    report.section(
        "Missing markers",
        "400 gf at 25 degrees under the probe; a tenth of the markers, others in each frame, not drawn.",
    )
    frames = 600 if quick else 2000
    force = 400 * GF * np.array([np.sin(np.radians(25)), 0, np.cos(np.radians(25))])
    displacement = np.repeat(probe(force[None]), frames, axis=0)
    gone = np.random.default_rng(20054).random((frames, displacement.shape[1])) < 0.1
    spread = []
    for mask in (None, gone):
        found = chain.run(displacement, missing=mask)
        spread.append(found.resultant_N.std(axis=0) / GF)
    report.row("deviation of the resultant (x, y, z), all markers", "{:.2f}, {:.2f}, {:.2f} gf".format(*spread[0]))
    report.row("    a tenth missing", "{:.2f}, {:.2f}, {:.2f} gf".format(*spread[1]))
    growth = np.linalg.norm(spread[1]) / np.linalg.norm(spread[0]) - 1
    report.row(
        "10 % of the markers missing: growth of the resultant's deviation",
        f"{100 * growth:+.0f} %",
        "–",
        "<= 15 %",
        0.15,
        growth,
        name="missing markers",
    )


def picture_motion(report, quick):
    report.section(
        "Motion of the picture and heat", "The probe with 200 gf; mean of 20 frames each, less the same without motion."
    )
    frames = 20
    displacement = np.repeat(probe(np.array([[0, 0, 200 * GF]])), frames, axis=0)
    cases = {
        "still": (0, 0, 0, 0, 1),
        "shift of 0.05 px": (0.05, 0, 0, 0, 1),
        "scale 1.0001": (0, 0, 1e-4, 0, 1),
        "roll of 0.1 mrad": (0, 0, 0, 1e-4, 1),
    }
    means = {}
    for label, stray in cases.items():
        found = chain.run(displacement, stray=np.tile(np.array(stray, float), (frames, 1)))
        means[label] = found.resultant_N.mean(0) / GF
    lines = [
        (label, *[f"{value:+.1f}" for value in mean - means["still"]])
        for label, mean in means.items()
        if label != "still"
    ]
    try:
        warm = truth.load(40, 0.49, "expansion").displacement
        found = chain.run(displacement + warm[0])
        lines.append(("1 K warmer", *[f"{value:+.1f}" for value in found.resultant_N.mean(0) / GF - means["still"]]))
    except FileNotFoundError:
        pass
    report.table(["what moves", "Fx [gf]", "Fy", "Fz"], lines)


def large_strain(report, quick):
    try:
        large = truth.load(40, 0.49, "large")
    except FileNotFoundError:
        return
    report.section(
        "Large strain",
        """
        The truth is a neo-Hookean gel with large deformations (CalculiX, NLGEOM), the inverse is linear. Hertz
        pressures at the centre whose directions do not follow the surface; mean of 10 frames. With 5 mm across
        CalculiX finds no equilibrium much beyond 300 gf: the true contact of a probe grows. Flagged: share of the
        frames marked as out of range or unexplained. Largest node: force of the strongest node in any frame in parts of
        E pitch^2.""",
    )
    frames = 10
    found = chain.run(np.repeat(large.displacement, frames, axis=0), zero_every=frames)
    mean = found.resultant_N.reshape(-1, frames, 3).mean(1) / GF
    flagged = ((found["flags"].astype(int) & (OUT_OF_RANGE | UNEXPLAINED)) != 0).reshape(-1, frames).mean(1)
    nodes = np.linalg.norm(found.force_N.reshape(-1, frames, 576, 3), axis=3).max((1, 2)) / (chain.YOUNG * 9e-6)
    lines = []
    for measured, true, contacts, flag, node in zip(mean, large.forces() / GF, large.contacts, flagged, nodes):
        lines.append(
            (
                f"{2e3 * contacts[0, 3]:.0f} mm",
                ", ".join(f"{value:.0f}" for value in true),
                ", ".join(f"{value:.1f}" for value in measured),
                f"{100 * (np.linalg.norm(measured) / np.linalg.norm(true) - 1):+.1f} %",
                f"{100 * flag:.0f} %",
                f"{node:.2f}",
            )
        )
    report.table(["across", "true [gf]", "measured [gf]", "length off", "flagged", "largest node"], lines)

"""What is seen of friction before a ball slips. Called like the paper's experiments; friction.py computes the truth."""

import numpy as np

import chain
import friction
import limits
import shapes
import slides
import slip_sequences
import truth
from report import rms
from unseen import ALL_KNOWN

THICKNESS = 40
LEAST, MOST = 0.25, 1.005  # shares of the shear at which the ball slips
SHARES = (0.25, 0.5, 0.7, 0.85, 0.95, MOST)


class Series:
    """Balls of random size, force, place and direction, each in two frames: the first one makes the model."""

    def __init__(self, count, generator):
        all_balls = [ball for path in sorted(truth.DATA.glob("ball_*.npz")) for ball in friction.balls(path)]
        all_balls = [ball for ball in all_balls if LEAST <= ball.share <= MOST]
        self.ball, self.radius, self.normal_N, self.displacement = [], [], [], []
        for _ in range(count):
            ball = all_balls[generator.integers(len(all_balls))]
            radius, normal_N, turn = generator.uniform(4e-3, 7e-3), generator.uniform(2, 8), generator.uniform(0, 2 * np.pi)
            place, size = generator.uniform(-0.02, 0.02, (2, 1)), radius / ball.radius
            self.displacement += 2 * [shapes.placed(THICKNESS, ball.points, ball.forces, normal_N, turn, size, place)]
            self.ball.append(ball)
            self.radius.append(radius)
            self.normal_N.append(normal_N)


def slip(report, quick):
    report.section(
        "Friction before a ball slips",
        """
        A ball is pressed and pulled sideways, by CalculiX's contact with friction (coefficients 0.3, 0.5, 0.8): contacts
        of 4 to 7 mm radius, 2 to 8 N, any place and direction; frames that are answered by the model of the frame
        before. Share: of the shear at which the ball slips. "Pictures": shear that grows by 3 N/s until the ball slips, 5 to
        7 mm, 400 gf and more, 60 frames/s, joined as by traction-touch; "drawn" from the errors of those, 0.5 to 3 N/s.
        Turned: a ball (friction 0.5), and, pulled as well, a bar of 8 x 3 mm with edges of 4 mm radius (0.5), a flat
        round punch of 6 mm with an edge of 2 mm radius (0.3) and a cylinder of 10 mm radius on its side (0.8), the last
        two to and fro, 2 to 6 N, single frames; the bound at any torque, and the friction that a slide shows in the
        moments in which all slips. Slides: these and a punch that is pulled alone (0.5), through the moments of CalculiX
        in half a second until all slips, and on at 2 to 10 mm/s, 60 frames/s; their motion is seen in the pictures, by
        traction-touch.""",
    )
    generator = np.random.default_rng([report.seed, 5])
    drawn = Series(40 if quick else 400, generator)
    found = chain.run(
        np.array(drawn.displacement),
        gel=chain.gel_text(THICKNESS) + ALL_KNOWN,
        zero_every=100,
        seed=report.seed % 2**20,
        answer=True,
    )
    answered = found["answered"][1::2, 0] > 0
    ratio, _, known, incipient, stick, low, high, mu, mu_low, mu_high = found["answer_slip"][1::2].T
    known = answered & (known > 0)
    share, true_stick, true = (np.array([getattr(b, n) for b in drawn.ball]) for n in ("share", "stick", "friction"))
    covered = (low <= true_stick) & (true_stick <= high)
    mu_covered = (mu_low <= true) & (true <= mu_high)
    lines = []
    for first, end in zip(SHARES, SHARES[1:]):
        here = (share >= first) & (share < end)
        use = here & known
        if use.sum() < 3:
            continue
        lines.append(
            (
                f"{first:.2f} - {min(end, 1):.2f}",
                f"{here.sum()}",
                f"{100 * use.sum() / here.sum():.0f} %",
                f"{rms((stick - true_stick)[use]):.3f}",
                f"{100 * covered[use].mean():.0f} %",
                f"{100 * rms((mu / true - 1)[use]):.0f} %",
                f"{100 * mu_covered[use].mean():.0f} %",
                f"{100 * (incipient[use] > 0.5).mean():.0f} %",
            )
        )
    report.table(
        ["share", "loads", "known", "stick ratio off", "covered", "friction off", "covered", "called incipient"], lines
    )
    large = (np.array(drawn.radius) >= 5e-3) & (np.array(drawn.normal_N) >= 400 * chain.GF)
    late = known & large & (share >= 0.7)
    sticks, frictions = rms((stick - true_stick)[late]), rms((mu / true - 1)[late])
    report.row("stick ratio at 70 % of slipping and more, 400 gf, 5 mm, rms", f"{sticks:.3f}", "<= 0.08", sticks)
    report.row("friction at 70 % of slipping and more, 400 gf, 5 mm, rms", f"{100 * frictions:.1f} %", "<= 8 %", frictions)
    for label, which in (("stick ratio", covered), ("friction", mu_covered)):
        part = which[known].mean()
        report.row(f"{label}: covered by its 95 % interval", f"{100 * part:.1f} %", "93 - 97 %", part)
    slip_sequences.sequences(report, quick, generator)
    for probe, name in (
        ("twisted_ball", "ball that is turned"),
        ("bar", "bar that is pulled and turned"),
        ("punch", "round punch that is pulled and turned"),
        ("roller", "cylinder that is pulled and turned"),
    ):
        any_contact(report, quick, generator, probe, name)
    balls = ["ball_0.65_0.3", "ball_0.5_0.5", "ball_0.65_0.8"]
    slides.slides(report, quick, generator, [*balls, "bar", "punch", "pulled_punch", "roller"])


def any_contact(report, quick, generator, probe, name):
    """The friction of what is no ball under shear: bounds at any load, slides where all slips."""
    (path,) = truth.DATA.glob(f"{probe}_*.npz")
    moments = [one for one in friction.moments(path) if friction.loaded(*one) > 0.1]
    drawn, displacement, loads = [], [], []
    for _ in range(30 if quick else 200):
        drawn.append(generator.integers(len(moments)))
        _, points, forces = moments[drawn[-1]]
        turn = generator.uniform(0, 2 * np.pi)
        rotation = shapes.turn(turn)
        forces = forces * generator.uniform(2, 6) / forces[2].sum()
        forces[:2] = rotation @ forces[:2]
        place = generator.uniform(-0.02, 0.02, (2, 1))
        points = generator.uniform(1, 1.3) * rotation @ points + place
        loads.append((points, forces))
        displacement.append(shapes.displacements(THICKNESS, points, forces))
    gel = chain.gel_text(THICKNESS) + ALL_KNOWN
    found = chain.run(np.array(displacement), gel=gel, zero_every=100, seed=report.seed % 2**20)
    low, mu, mu_low, mu_high = found["friction"].T
    true, all_slips = moments[0][0], friction.slipping(moments)[drawn] & (mu_high > 0)
    bounded = low > 0
    report.row(
        f"{name}: friction at or above the low end of the bound",
        f"{100 * (low[bounded] <= true).mean():.0f} % of {bounded.sum()}; the largest {low.max() / true:.2f} of it",
        ">= 97.5 %",
        (low[bounded] <= true).mean(),
    )
    covered, off = ((mu_low <= true) & (true <= mu_high))[all_slips].mean(), mu[all_slips] / true - 1
    report.row(
        f"{name}, while it slides: friction off, mean and rms; covered by its interval",
        f"{100 * off.mean():+.0f} %, {100 * rms(off):.0f} %; {100 * covered:.0f} % of {all_slips.sum()}",
        ">= 93 %",
        covered,
    )
    nodes(report, name, found, loads, np.array([friction.loaded(*moments[one]) for one in drawn]))


def nodes(report, name, found, loads, used):
    """How far the shear ratio of the nodes is told apart in the middle of a contact and at its rim."""
    force, deviation = (found[which].reshape(len(loads), -1, 3) for which in ("force_N", "deviation_N"))
    read, true = [], []
    for (points, forces), at, of in zip(loads, force, deviation):
        seen = at[:, 2] > 3 * of[:, 2]  # as shearRatio()
        read.append(middle_over_rim(limits.NODES[:, seen], at[seen].T, points, forces[2]))
        true.append(middle_over_rim(points, forces, points, forces[2]))
    told = []
    for first, end in ((0.5, 0.7), (0.7, 0.9), (0.9, 1.2)):
        here = (used >= first) & (used < end) & np.isfinite(read)
        of_these, truly = np.array(read)[here], np.array(true)[here]
        told.append(f"{of_these.mean():.2f} +- {of_these.std():.2f} ({truly.mean():.2f})")
    figure = "shear ratio of middle over rim while 50 - 70, 70 - 90, 90 - 100 % of the friction are used: read (true)"
    report.row(f"{name}: {figure}", "; ".join(told))


def middle_over_rim(places, forces, points, pressure):
    """Shear over normal force within the ellipse of the pressure's deviations, over that beyond 1.5 of them."""
    centre = points @ pressure / pressure.sum()
    away, arms = places - centre[:, None], points - centre[:, None]
    spread = arms * pressure @ arms.T / pressure.sum()
    squared = np.einsum("ip,ij,jp->p", away, np.linalg.inv(spread), away)
    parts = [forces[:, squared < 1], forces[:, squared > 2.25]]
    if min(part.shape[1] for part in parts) == 0:
        return np.nan
    middle, rim = (np.hypot(*part[:2]).sum() / part[2].sum() for part in parts)
    return middle / rim

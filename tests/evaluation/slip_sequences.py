"""The alarm before a ball slips, and its friction by many frames. Part of the section of slip.py.

A ball is pressed, and its shear grows evenly: between the moments of CalculiX the forces are interpolated by the share
of the shear at which it slips. Some go through pictures. What is read there of the spread of shear (ratio, deviation)
is split into an error that stays, a polynomial of the share, and noise with its correlation from frame to frame;
a thousand are drawn from these errors with new noise.
"""

import numpy as np

import chain
import friction
import shapes
import truth
from report import rms
from unseen import ALL_KNOWN

THICKNESS, RATE = 40, 60  # mm; frames a second
FIRST = 0.15  # share from which on a moment is used
FASTEST = 3.0  # N/s
HELD_S = 60
INCIPIENT = 2  # touch::SlipState, and beyond
STAYS = 2  # degree of the polynomial


def spread_ratio(ball):
    (x, y), (fx, _, fz) = ball.points, ball.forces
    squares = x * x + y * y
    return (squares * fx).sum() / fx.sum() / ((squares * fz).sum() / fz.sum())


class Path:
    """A ball's contact from little shear until it slips: its moments, by increasing share."""

    def __init__(self, path):
        moments = [ball for ball in friction.balls(path) if ball.share > FIRST]
        last = next(number for number, ball in enumerate(moments) if ball.share > 0.99)
        self.moments = moments[: last + 1]
        self.friction = moments[0].friction
        self.share = np.array([ball.share for ball in self.moments])
        self.share[-1] = 1  # where it slips, the shares differ from 1 by the contact's penalties
        self.stick = np.array([ball.stick for ball in self.moments])
        self.ratio = np.array([spread_ratio(ball) for ball in self.moments])

    def weights(self, share):
        """Of each moment, frames x moments."""
        return np.array([np.interp(share, self.share, row) for row in np.eye(len(self.share))]).T


def left_out(paths):
    """How far the ratio of a moment lies from what its neighbours say: four times the error of the interpolation."""
    off = []
    for path in paths:
        inside = np.arange(1, len(path.share) - 1)
        inside = inside[path.share[inside] > 0.4]
        for i in inside:
            others = np.delete(np.arange(len(path.share)), i)
            off.append(np.interp(path.share[i], path.share[others], path.ratio[others]) - path.ratio[i])
    return rms(off)


class Pull:
    """A contact whose shear grows."""

    def __init__(self, path, generator, rate):
        self.path, self.rate = path, rate
        self.radius, self.normal_N = generator.uniform(5e-3, 7e-3), generator.uniform(400 * chain.GF, 8)
        slips_N = path.friction * self.normal_N
        begin = path.share[0]
        self.share = np.arange(begin, 1, rate / RATE / slips_N)
        self.turn, self.place = generator.uniform(0, 2 * np.pi), generator.uniform(-0.02, 0.02, (2, 1))

    def displacement(self):
        rotation, moments = shapes.turn(self.turn), []
        for ball, share in zip(self.path.moments, self.path.share):
            forces = ball.forces * self.normal_N / ball.forces[2].sum()
            forces[:2] = rotation @ forces[:2] * share * self.path.friction * self.normal_N / forces[0].sum()
            points = self.radius / ball.radius * rotation @ ball.points + self.place
            moments.append(shapes.displacements(THICKNESS, points, forces))
        return np.tensordot(self.path.weights(self.share), moments, 1)


def judged(sequences):
    """What touch says of sequences of observations (rows x 23, one a contact; see parts.cpp): a list of fields x 10."""
    rows = [np.c_[np.full(len(one), number), one] for number, one in enumerate(sequences)]
    with chain.job(observations=np.concatenate(rows)) as job:
        chain.call("parts", "slip", job)
        found = np.fromfile(job / "slip.f64").reshape(-1, 10)
    return np.split(found, np.cumsum([len(np.unique(one[:, 0])) for one in sequences])[:-1])


def observations(found, lengths):
    """Of sequences of so many frames: time and contacts; a row of zeros where there is none."""
    contacts, shapes_found = (found[n].reshape(len(found[n]), -1, w) for n, w in (("contacts", 12), ("shapes", 10)))
    sequences, frame = [], 0
    for length in lengths:
        count = np.maximum(found["contact_count"][frame : frame + length, 0].astype(int), 1)
        which = frame + np.repeat(np.arange(length), count), np.concatenate([np.arange(each) for each in count])
        sequences.append(np.c_[(which[0] - frame) / RATE, contacts[which], shapes_found[which]])
        frame += length
    return sequences


class Errors:
    """Of the ratio that was read in a pull: what stays and what is new."""

    def __init__(self, pull, seen):
        seen = seen[np.unique(seen[:, 0], return_index=True)[1]]  # the strongest contact of each frame
        ratio, deviation = seen[:, 13], seen[:, 14]
        known = deviation > 0
        self.pull, self.useful = pull, known.sum() > 12
        if not self.useful:
            return
        share, off = pull.share[known], (ratio - np.interp(pull.share, pull.path.share, pull.path.ratio))[known]
        weight = 1 / deviation[known]
        self.stays = np.polyfit(share, off, STAYS, w=weight)
        self.deviation = np.polyfit(share, deviation[known], STAYS)
        new = (off - np.polyval(self.stays, share)) * weight
        self.new = rms(new) * np.sqrt(len(new) / (len(new) - STAYS - 1))
        self.correlation = (new[1:] * new[:-1]).mean() / (new**2).mean()
        self.place_deviation = np.median(seen[known, 3:5], axis=0)
        self.force_deviation = np.median(seen[known, 8:11], axis=0)

    def draw(self, share, generator, correlation):
        """Observations of a pull of these shares, by the same errors that stay."""
        noise = generator.standard_normal(len(share))
        for k in range(1, len(noise)):
            noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
        deviation = np.maximum(np.polyval(self.deviation, share), 0.01)
        path = self.pull.path
        ratio = np.interp(share, path.share, path.ratio) + np.polyval(self.stays, share) + self.new * deviation * noise
        force = np.outer(np.ones(len(share)), [0, 0, self.pull.normal_N])
        force[:, 0] = share * path.friction * self.pull.normal_N
        force += self.force_deviation * generator.standard_normal(force.shape)
        place = self.place_deviation * generator.standard_normal((len(share), 2))
        deviations = (np.tile(each, (len(share), 1)) for each in (self.place_deviation, self.force_deviation))
        place_deviation, force_deviation = deviations
        time, area = np.arange(len(share)) / RATE, np.tile([5e-5, 1e-6], (len(share), 1))
        shape = np.zeros((len(share), 8))  # without torque
        return np.c_[time, place, place_deviation, force, force_deviation, area, ratio, deviation, shape]


def alarm(found):
    return found[:, 0] >= INCIPIENT


def report_pulls(report, label, pulls, found):
    """Alarms and friction of pulls; `pulls`: path and shares of each."""
    late, early, foretold, known, off, stick_off, covered, stick_covered = [], 0, 0, [], [], [], [], []
    for (path, share), one in zip(pulls, found):
        state, stick, low, high, mu, mu_low, mu_high = one[:, :7].T
        on = alarm(one)
        early += (on & (share < 0.7)).any()
        useful = np.flatnonzero(on & (share >= 0.7))
        foretold += len(useful) > 0
        due = np.searchsorted(share, 0.9)
        late.append(max(0, useful[0] - due) if len(useful) else np.inf)
        use = (share >= 0.7) & (state >= 0)
        known += [(state >= 0)[share >= 0.7]]
        true_stick = np.interp(share, path.share, path.stick)
        off += [(mu / path.friction - 1)[use]]
        stick_off += [(stick - true_stick)[use]]
        covered += [((mu_low <= path.friction) & (path.friction <= mu_high))[use]]
        stick_covered += [((low <= true_stick) & (true_stick <= high))[use]]
    late = np.array(late)
    on_time = (late <= 2).mean()
    report.row(
        f"{label}: alarm at most 2 frames after 90 % of slipping",
        f"{100 * on_time:.1f} %; median {np.median(late):.0f}, 99 % by {np.quantile(late, 0.99, method='higher'):.0f}",
        ">= 99 %",
        on_time,
    )
    report.row(f"{label}: slips foretold", f"{foretold} of {len(late)}", ">= 99 %", foretold / len(late))
    report.row(f"{label}: alarm before 70 %", f"{early} of {len(late)}")
    report.row(f"{label}: frames from 70 % on in which slip is known", f"{100 * np.concatenate(known).mean():.0f} %")
    off, stick_off, covered, stick_covered = map(np.concatenate, (off, stick_off, covered, stick_covered))
    report.row(f"{label}: stick ratio from 70 % on, rms", f"{rms(stick_off):.3f}", "<= 0.08", rms(stick_off))
    report.row(f"{label}: friction from 70 % on, rms", f"{100 * rms(off):.1f} %", "<= 8 %", rms(off))
    for name, which in (("stick ratio", stick_covered), ("friction", covered)) if label == "pictures" else ():  # the drawn errors are theirs
        report.row(
            f"{label}: {name} covered by its interval, from 70 % on", f"{100 * which.mean():.1f} %", "93 - 97 %", which.mean()
        )


def sequences(report, quick, generator):
    paths = [Path(path) for path in sorted(truth.DATA.glob("ball_*.npz"))]
    report.row("moments left out: ratio of the spreads, by their neighbours, rms", f"{left_out(paths):.3f}")
    pulls = [Pull(paths[i % len(paths)], generator, FASTEST) for i in range(6 if quick else 60)]
    found = chain.run(
        np.concatenate([pull.displacement() for pull in pulls]),
        gel=chain.gel_text(THICKNESS) + ALL_KNOWN,
        zero_every=10**6,
        seed=report.seed % 2**20,
        as_daemon=True,
    )
    seen = observations(found, [len(pull.share) for pull in pulls])
    report_pulls(report, "pictures", [(pull.path, pull.share) for pull in pulls], judged(seen))
    errors = [one for one in (Errors(pull, part) for pull, part in zip(pulls, seen)) if one.useful]
    correlation = np.median([one.correlation for one in errors])
    middle = np.array([np.polyval(one.stays, 0.8) / np.polyval(one.deviation, 0.8) for one in errors])
    report.row(
        "ratio: noise from frame to frame / deviation; its correlation",
        f"{np.median([one.new for one in errors]):.2f}; {correlation:.2f}",
    )
    report.row("ratio at 80 %: error that stays / deviation: mean, scatter", f"{middle.mean():+.2f}, {middle.std():.2f}")
    drawn, shares = [], []
    for _ in range(60 if quick else 1000):
        one = errors[generator.integers(len(errors))]
        rate = generator.uniform(0.5, FASTEST)
        share = np.arange(one.pull.share[0], 1, rate / RATE / one.pull.path.friction / one.pull.normal_N)
        drawn.append(one.draw(share, generator, correlation))
        shares.append((one.pull.path, share))
    report_pulls(report, "drawn", shares, judged(drawn))
    drawn = []
    for _ in range(20 if quick else 240):
        one = errors[generator.integers(len(errors))]
        to, step = generator.uniform(0.2, 0.7), FASTEST / RATE / one.pull.path.friction / one.pull.normal_N
        share = np.append(np.arange(one.pull.share[0], to, step), np.full(RATE * HELD_S, to))
        drawn.append(one.draw(share, generator, correlation))
    held = judged(drawn)
    alarms = sum((np.diff(np.append(0, alarm(one).astype(int))) > 0).sum() for one in held)
    hours = sum(map(len, drawn)) / RATE / 3600
    report.row(
        f"held at 20 to 70 % for {HELD_S} s each: false alarms, contacts with one",
        f"{alarms} in {hours:.1f} h, {sum(alarm(one).any() for one in held)} of {len(held)}",
        "< 1 per hour",
        alarms / hours,
    )

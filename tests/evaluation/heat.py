"""Eight hours of handling in a room whose temperature changes: what is read of forces, and while nothing touches."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import chain
import creep
import truth
from chain import GF

HOURS, RANGE_K = 8, 10
STEADY_S = 1.0  # after a load has come or gone
LIMIT_GF = 1.0
RECOVERING = 1024
HYSTERESIS = np.geomspace(0.05, 2000, 8)  # times of what the calibrated terms do not have [s]


class Day:
    """One gel with hidden numbers, and what is done with it."""

    def __init__(self, seed, hours):
        draw = np.random.default_rng(seed)
        self.seed = seed
        self.time_s = np.arange(0, 3600.0 * hours)
        self.terms = creep.drawn(draw)
        self.hysteresis = np.column_stack([draw.uniform(0, 0.002, len(HYSTERESIS)), HYSTERESIS])
        periods_s = 3600 * np.array([8, 5, 3, 1.5]) * draw.uniform(0.8, 1.2, 4)
        waves = np.sin(2 * np.pi * (self.time_s[:, None] / periods_s + draw.uniform(0, 1, 4))) @ draw.uniform(0, 1, 4)
        self.heat_K = waves * RANGE_K / abs(waves).max()
        self.heat_K -= self.heat_K[0]  # the zero is taken at the start
        self.expansion = draw.uniform(0.5, 1.2)  # of that of truth.expansion()
        per_K = draw.normal(0, [0.05, 0.05, 2e-5, 2e-5])
        vibration = draw.normal(0, [0.005, 0.005, 2e-5, 2e-5], (len(self.time_s), 4))
        self.stray = np.column_stack([self.heat_K[:, None] * per_K + vibration, np.ones(len(self.time_s))])
        self.handle(draw)

    def handle(self, draw):
        """Loads one after another: 2 s to 2 min each, 5 s to 3 min apart; 5 to 300 gf."""
        loads = truth.load(40, 0.49, "random")
        single = [i for i, load in enumerate(loads.contacts) if np.isfinite(load[:, 0]).sum() == 1]
        patterns, amounts = [truth.load(40, 0.49, "expansion").displacement[0]], [self.expansion * self.heat_K]
        self.force_N, self.steady = np.zeros((len(self.time_s), 3)), np.ones(len(self.time_s), bool)
        at = 60.0
        while True:
            at += np.exp(draw.uniform(np.log(5), np.log(180)))
            held = np.exp(draw.uniform(np.log(2), np.log(120)))
            force = np.exp(draw.uniform(np.log(5), np.log(300))) * GF
            which = draw.choice(single)
            if at + held + STEADY_S > self.time_s[-1]:
                break
            amount = np.zeros(len(self.time_s))
            since = slice(int(at), None)
            for sign, then in ((1, at), (-1, at + held)):
                past = np.maximum(self.time_s[since] - then, 0)
                grown = sum(
                    creep.growing(terms, past) - creep.growing(terms, past - creep.RAMP_S)
                    for terms in (self.terms, self.hysteresis)
                )
                amount[since] += sign * (np.minimum(past / creep.RAMP_S, 1) + grown)
            patterns.append(loads.displacement[which])
            amounts.append(force * amount)
            on = (self.time_s >= at) & (self.time_s < at + held)
            self.force_N[on] = force * loads.forces()[which]
            for then in (at, at + held):
                self.steady &= abs(self.time_s - then - STEADY_S / 2) > STEADY_S / 2 + creep.RAMP_S
            at += held
        self.patterns, self.amounts = np.array(patterns), np.column_stack(amounts)

    def read(self):
        return chain.run(
            self.patterns,
            amount=self.amounts,
            picture=self.stray,
            time=self.time_s,
            gel=creep.calibrated(self.terms, self.seed % 10**6),
            state=chain.state_directory("creep"),
            given=0.02,
            brief=True,
            seed=self.seed % 10**6,
        )


def heat(report, quick):
    report.section(
        "Eight hours of handling and heat",
        f"""
        One frame a second, displacements with 0.02 px of noise, no pictures. Loads by CalculiX of 5 to 300 gf, 2 s to 2 min each, 5 s to 3 min apart.
        The temperature changes by up to {RANGE_K} K either way from its mean: the gel bends as CalculiX's block does, by 0.5 to 1.2 of silicone's
        expansion, and the picture moves with it. The gel creeps by two hidden terms, which `tractionctl calibrate creep` has measured, and by eight
        more of 0 to 0.2 % each, of 0.05 to 2000 s, which it cannot tell. One zero, at the start.""",
    )
    days = [Day(report.seed + number, 2 if quick else HOURS) for number in range(1 if quick else 4)]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(Day.read, days))
    lines, drifts, false, covered = [], [], [], []
    for day, read in zip(days, found):
        error_gf = (read.resultant_N - day.force_N) / GF
        deviation_gf = read.deviation[:, :3] / GF
        held = (day.force_N != 0).any(1) & day.steady
        idle = (day.force_N == 0).all(1) & day.steady
        flagged = read.flags[:, 0].astype(int) & RECOVERING != 0
        parts = np.array_split(np.arange(len(idle)), len(idle) // 1800)
        drifts += [np.linalg.norm(error_gf[part][idle[part] & ~flagged[part]].mean(0)) for part in parts]
        length_gf = np.linalg.norm(error_gf, axis=1)
        false.append(length_gf[idle & ~flagged])
        covered.append(abs(error_gf[held]) <= 1.96 * deviation_gf[held])
        lines.append(
            (
                f"{np.ptp(day.heat_K):.0f}",
                f"{len(day.patterns) - 1}",
                f"{100 * (false[-1] > LIMIT_GF).mean():.1f} %",
                f"{false[-1].max():.1f}",
                f"{100 * flagged[idle].mean():.1f} %",
                ", ".join(f"{100 * share:.1f}" for share in covered[-1].mean(0)) + " %",
                ", ".join(f"{rms:.2f}" for rms in np.sqrt((error_gf[held] ** 2).mean(0))),
            )
        )
    report.table(
        ["range [K]", "loads", "untouched: above 1 gf", "largest [gf]", "recovering", "covered (x, y, z)", "rms error [gf]"],
        lines,
    )
    report.row(
        "drift of the zero in eight hours: untouched fields, means of half hours, the largest",
        f"{max(drifts):.2f} gf",
        "<= 1 gf",
        max(drifts),
    )
    report.row("    single fields above 1 gf that are not flagged", f"{100 * (np.concatenate(false) > LIMIT_GF).mean():.2f} %")
    share = np.concatenate(covered).mean()
    report.row(
        "    95 % interval of a component of a held load",
        f"{100 * share:.1f} % of {np.concatenate(covered).size}",
        "93 – 97 %",
        share,
    )

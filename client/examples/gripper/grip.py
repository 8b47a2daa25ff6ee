"""Decides how a gripper with two feeling fingers picks up a thing of which nothing is known: as grip.h.

It closes until it touches, and raises the hand while it presses ever harder. The fingers slide until friction carries
the thing: the ratio of shear to normal force, while they slid, is the coefficient of friction. From then on it holds by
weight and friction.
"""

import enum
import math
from dataclasses import dataclass

FIRST_TOUCH_N = 0.3  # normal force at which raising begins
MOST_NORMAL_N = 5.0  # is never exceeded: things break, and the gel has its range
RESERVE = 1.12  # normal force over the least that holds: for errors of the friction
HEIGHT_M, HOLD_S = 40e-3, 6.0  # to which it lifts, and for how long
CLOSING_M_S, PROBING_M_S, LIFTING_M_S, PRESSING_N_S = 5e-3, 1e-3, 20e-3, 1.0
YIELD_M_N_S = 15e-3  # speed of the opening for each newton that is missing
SMOOTHING_S, WEIGHING_S = 0.08, 0.5


class Phase(enum.Enum):
    CLOSE, PROBE, LIFT, HOLD, LOWER, OPEN, DONE, FAILED = range(8)


@dataclass
class Finger:
    """What a finger feels in one frame; `across` and `up` are forces on the thing."""

    normal_N: float = 0.0
    across_N: float = 0.0
    up_N: float = 0.0
    slides: bool = False

    @property
    def touches(self) -> bool:
        return self.normal_N > 0.05


class Grip:
    def __init__(self, opening_m: float, jerk_m_s2: float) -> None:
        self.start_m = self.opening_m = opening_m
        self.jerk_m_s2, self.height_m, self.caution = jerk_m_s2, 0.0, 1.0
        self.friction = self.carried_N = self.grown_N = self.wanted_N = 0.0
        self.normal_N = self.shear_N = 0.0  # smoothed
        self.since_s = self.settled_s = self.lost_s = 0.0
        self.phase = Phase.CLOSE

    def enter(self, phase: Phase) -> None:
        self.phase, self.since_s = phase, 0.0
        if phase is Phase.FAILED:
            self.opening_m = self.start_m

    def press(self, wanted_N: float, normal_N: float, dt_s: float) -> None:
        """Moves the fingers so that each will press with `wanted_N`."""
        self.wanted_N = wanted_N
        self.opening_m -= YIELD_M_N_S * (wanted_N - normal_N) * min(dt_s, 1 / 30)

    def hold(self, normal_N: float, shear_N: float, slides: bool, dt_s: float) -> None:
        if slides:
            self.caution = min(self.caution + dt_s, 1.5)
        self.carried_N += (shear_N - self.carried_N) * min(dt_s / WEIGHING_S, 1.0)
        most_N = max(self.carried_N * (1 + self.jerk_m_s2 / 9.81), shear_N)
        self.press(min(self.caution * RESERVE * most_N / self.friction, MOST_NORMAL_N), normal_N, dt_s)

    def step(self, a: Finger, b: Finger, dt_s: float) -> None:
        """Takes what both fingers feel, `dt_s` after the last time: opening_m and height_m are where to go."""
        touches, slides = a.touches and b.touches, a.slides or b.slides
        normal_N, up_N = 0.5 * (a.normal_N + b.normal_N), 0.5 * (a.up_N + b.up_N)
        shear_N = math.hypot(up_N, 0.5 * (a.across_N + b.across_N))
        self.since_s += dt_s
        self.normal_N += (normal_N - self.normal_N) * min(dt_s / SMOOTHING_S, 1.0)
        self.shear_N += (shear_N - self.shear_N) * min(dt_s / SMOOTHING_S, 1.0)
        if self.phase is Phase.CLOSE and not touches:
            self.opening_m -= CLOSING_M_S * dt_s
            if self.opening_m <= 0:
                self.enter(Phase.FAILED)  # there is nothing
        elif self.phase is Phase.CLOSE:
            self.press(FIRST_TOUCH_N, normal_N, dt_s)
            self.settled_s += dt_s * (abs(normal_N - FIRST_TOUCH_N) < 0.2 * FIRST_TOUCH_N)
            if self.settled_s > 0.2:
                self.enter(Phase.PROBE)
        elif self.phase is Phase.PROBE:
            self.height_m += PROBING_M_S * dt_s
            self.friction = max(self.friction, self.shear_N / max(self.normal_N, 0.05))
            if self.shear_N > 1.03 * self.carried_N:
                self.carried_N, self.grown_N = self.shear_N, self.normal_N
            if self.normal_N > 1.15 * self.grown_N and self.since_s > 0.5 and self.carried_N > 0.02:
                self.carried_N = self.shear_N  # it hangs: more normal force brings no more shear
                self.enter(Phase.LIFT)
            else:
                self.press(self.wanted_N + PRESSING_N_S * dt_s * (self.since_s > 0.4), normal_N, dt_s)
                if self.wanted_N > MOST_NORMAL_N:
                    self.enter(Phase.FAILED)  # it is too heavy, or too slippery
        elif self.phase in (Phase.LIFT, Phase.HOLD):
            self.hold(normal_N, shear_N, slides, dt_s)
            if self.phase is Phase.LIFT and self.since_s > 0.3:
                self.height_m = min(self.height_m + LIFTING_M_S * dt_s, HEIGHT_M)
            if self.phase is Phase.LIFT and self.height_m >= HEIGHT_M:
                self.enter(Phase.HOLD)
            elif self.phase is Phase.HOLD and self.since_s > HOLD_S:
                self.enter(Phase.LOWER)
        elif self.phase is Phase.LOWER:
            self.hold(normal_N, shear_N, False, dt_s)
            self.height_m -= (LIFTING_M_S if self.height_m > 5e-3 else 2 * PROBING_M_S) * dt_s
            if up_N < 0.3 * self.carried_N or self.height_m < -5e-3:
                self.enter(Phase.OPEN)
        elif self.phase is Phase.OPEN:
            self.opening_m = min(self.opening_m + CLOSING_M_S * dt_s, self.start_m)
            if self.opening_m >= self.start_m:
                self.enter(Phase.DONE)
        carries = self.phase in (Phase.LIFT, Phase.HOLD, Phase.LOWER)
        self.lost_s = self.lost_s + dt_s if carries and not touches else 0.0
        if self.lost_s > 0.3:
            self.enter(Phase.FAILED)  # it fell

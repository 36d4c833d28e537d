"""The claims of the paper on the smooth S-curve, each with a verdict from the study's numbers."""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.reproduce.claims import Claim, Verdict
from shaper_fmu.reproduce.runs import last_crossing
from shaper_fmu.reproduce.s_curve.runs import Residuals
from shaper_fmu.reproduce.s_curve.study import CRUISE, DURATIONS, GRID, Study

THRESHOLD = 0.05
"""Residual that the paper takes for none, as a share of a step's."""

SPEED_LIMIT = 1.0
"""Speed of the paper's actuator [m/s]."""


def claims(study: Study) -> list[Claim]:
    """All claims, in the paper's order."""
    return [*_abstract(study), *_introduction(study), *_model(study), *_profile(study), *_simulations(study)]


def percent(value: float) -> str:
    """A share as percents, three digits of it."""
    return f"{100.0 * value:.3g} %"


def first_mode(moves: list[Residuals]) -> np.ndarray:
    """Relative residual of the first mode, shape (n,)."""
    return np.array([residuals.relative[0] for residuals in moves])


def _verdict(holds: bool) -> Verdict:
    return "reproduced" if holds else "not reproduced"


def _over(moves: dict[float, Residuals]) -> str:
    return ", ".join(percent(moves[r].relative[0]) for r in DURATIONS)


def _abstract(study: Study) -> list[Claim]:
    nominal, polynomial = study.nominal, study.polynomial
    from_08 = max(residuals.relative[0] for r, residuals in zip(GRID, study.scans["S-curve"], strict=True) if r > 0.799)
    lower = all(nominal[r].relative[0] < polynomial[r].relative[0] for r in DURATIONS)
    calmer = all(nominal[r].deflection < polynomial[r].deflection for r in DURATIONS)
    above = [r for r in DURATIONS if polynomial[r].relative[0] >= THRESHOLD]
    coarse, fine = study.jumps
    return [
        Claim(
            "The S-curve keeps the residual vibration below 5 % even for moves as short as 0.8 natural periods (abstract).",
            f"{percent(nominal[0.8].relative[0])} at 0.8 periods; at most {percent(from_08)} from there to 5 periods",
            _verdict(from_08 < THRESHOLD),
            "The profile is exact for every duration; what is left is the master's, which holds the acceleration over each step. "
            f"It is not so of a beam 5 % off in frequency: {percent(study.stiffer[0.8].relative[0])} at 0.8 periods.",
        ),
        Claim(
            "The 3-4-5 polynomial shows significant residual vibration across all tested durations (abstract).",
            f"{_over(polynomial)} at {', '.join(map(str, DURATIONS))} periods",
            _verdict(len(above) == len(DURATIONS)),
            f"There is residual vibration at all five, but by the paper's own threshold of 5 % it is significant at "
            f"{' and '.join(map(str, above))} periods alone.",
        ),
        Claim(
            "The S-curve has lower vibration amplitudes, particularly for short moves (abstract).",
            f"at 0.8 periods {percent(nominal[0.8].relative[0])} against {percent(polynomial[0.8].relative[0])} after the move, "
            f"and {1e3 * nominal[0.8].deflection:.3g} mm against {1e3 * polynomial[0.8].deflection:.3g} mm during it (0.1 m)",
            _verdict(lower and calmer),
            "Residual amplitude and largest deflection of the tip, both lower than the polynomial's at all five durations.",
        ),
        Claim(
            "It keeps smooth acceleration characteristics (abstract).",
            f"largest change in a step: {coarse:.3g} m/s2 with 288 steps a period, {fine:.3g} m/s2 with 2880",
            _verdict(abs(coarse / fine - 10.0) < 0.2),
            f"The acceleration is continuous (its jerk is not). At 0.8 periods it swings to {nominal[0.8].acceleration:.3g} m/s2, "
            f"{nominal[0.8].acceleration / polynomial[0.8].acceleration:.2g} times the polynomial's, and the base moves backwards "
            f"on its way, at up to {-np.min(study.shown['s_curve', 0.8]['profile.velocity']):.2g} m/s.",
        ),
    ]


def _introduction(study: Study) -> list[Claim]:
    at, scans = study.at_period, study.scans
    smooth, trapezoid = first_mode(scans["S-curve"]), first_mode(scans["trapezoidal velocity"])
    more = trapezoid > smooth + 1e-4
    touching = trapezoid < 1e-4  # both leave nothing there
    return [
        Claim(
            "A trapezoidal velocity tends to leave more residual vibration than an S-curve (section 1).",
            f"at {np.count_nonzero(more)} of {len(GRID)} durations from 0.4 to 5 periods, "
            f"by up to {percent(np.max(trapezoid - smooth))}",
            _verdict(bool(np.all(more | touching))),
            "Against the proposed S-curve, with ramps of a third of the move; equal where its ramps last whole periods.",
        ),
        Claim(
            "It is well known that no residual vibration occurs, whatever the input function, when its duration is the natural "
            "period (section 1).",
            f"after one period: polynomial {percent(at['3-4-5 polynomial'])}, cycloid {percent(at['cycloid'])}, "
            f"trapezoidal velocity {percent(at['trapezoidal velocity'])}",
            _verdict(max(at["3-4-5 polynomial"], at["cycloid"], at["trapezoidal velocity"]) < THRESHOLD),
            f"As said, of whole moves, it is not so. It holds of the ramps of a velocity: those of one period each leave "
            f"{percent(at['ramps of a period'])}.",
        ),
        Claim(
            "The duration is not limited to multiples or half multiples of the natural period (section 1).",
            f"at most {percent(float(np.max(smooth)))} at {len(GRID)} durations from 0.4 to 5 periods",
            _verdict(float(np.max(smooth)) < 1e-3),
            "Every twentieth of a period.",
        ),
        Claim(
            "An analysis of the critical constraints gives the solution of minimum time within the actuator's limits (section 1).",
            f"{study.nominal[0.8].velocity:.3f} m/s at 0.8 periods and 0.1 m, where eqs. (18), (23) and (24) give "
            f"{study.cruise[0.8]:.3f} m/s",
            _verdict(study.nominal[0.8].velocity <= SPEED_LIMIT),
            f"Eqs. (20) to (24) take the duration as given, and keep A tau below the limit of 1 m/s. But for segments shorter than "
            f"about 0.24 periods the speed swings beyond A tau: the shortest move of 0.1 m that keeps to 1 m/s takes "
            f"{study.shortest[0.1]:.3f} periods, as the MotionProfile FMU calculates.",
        ),
    ]


def _model(study: Study) -> list[Claim]:
    w = study.frequencies
    beta = math.sqrt(w[0] / math.sqrt(0.05 / (0.02 * 0.25**3)))
    others = [residuals.modes[1:].sum() for r in DURATIONS if (residuals := study.modes["S-curve", 0.0, r])]
    worst = max(float(residuals.modes[1:].sum()) for residuals in study.mode_scans["S-curve"][1])
    return [
        Claim(
            "beta = 1.3202 and a natural frequency of 22.0487 rad/s for the beam of Table 1 (eq. 7, section 4).",
            f"beta = {beta:.7f}, {w[0]:.6f} rad/s",
            _verdict(abs(beta - 1.3202) < 1e-4 and abs(w[0] - 22.0487) < 5e-5),
            "The frequency of the FlexibleBeam FMU; beta by w = beta^2 sqrt(EI / m L^3). The paper cuts beta's digits off.",
        ),
        Claim(
            "Only the first mode need be considered; the amplitudes of the others are insignificantly small (section 2).",
            f"modes 2 to 5 together leave {', '.join(percent(x) for x in others)} of the distance at the five durations, at most "
            f"{percent(worst)} from 0.8 to 2.4 periods",
            _verdict(worst < 0.01),
            "Five undamped modes, the S-curve designed for the first. Below one period they grow fast as the move gets shorter.",
        ),
    ]


def _profile(study: Study) -> list[Claim]:
    distance, duration, speed = CRUISE
    return [
        Claim(
            "Speeds and positions at the ends of the five segments, eqs. (15) and (16), with A, tau and T3 by eqs. (20) to (22).",
            f"largest deviation {study.segment_error:.1e} of the speed or distance",
            _verdict(study.segment_error < 1e-12),
            f"A move of {distance} m in {duration} s at {speed} m/s; eq. (14) read with t3 and t4 in its last two lines.",
        ),
        Claim(
            "The method is analytic and so is easily adapted to other system parameters (section 5).",
            ", ".join(f"{name}: {percent(value)}" for name, value in study.others.items()),
            _verdict(max(study.others.values()) < 1e-3),
            "The S-curve of 0.8 periods of other beams, each designed for the first frequency that the beam's FMU computes.",
        ),
    ]


def _simulations(study: Study) -> list[Claim]:
    half = int(np.argmin(np.abs(GRID - 0.5)))
    smooth, polynomial = study.scans["S-curve"][half], study.scans["3-4-5 polynomial"][half]
    ends = {name: last_crossing(GRID, first_mode(moves), THRESHOLD) for name, moves in study.scans.items() if name != "S-curve"}
    last = max(ends.values())
    off = sum(study.stiffer[r].relative[0] < study.polynomial_stiffer[r].relative[0] for r in DURATIONS)
    short = max(first_mode(study.scans["S-curve"])[:8])
    return [
        Claim(
            "The S-curve leaves no residual vibration at 0.8, 1.25, 1.75, 2.25 and 4.25 periods (figures 3a and 3b).",
            _over(study.nominal),
            _verdict(max(residuals.relative[0] for residuals in study.nominal.values()) < 1e-7),
            "80000 steps a period; with steps of a tenth the rest grows a hundredfold, so it is the master's.",
        ),
        Claim(
            "In theory nothing limits the duration, but below half a period the accelerations get excessively high (section 4).",
            f"{smooth.acceleration:.3g} m/s2 at 0.5 periods and 0.1 m, the polynomial's {polynomial.acceleration:.3g} m/s2",
            _verdict(short < 1e-3 and smooth.acceleration > 10.0 * polynomial.acceleration),
            f"At most {percent(short)} is left down to 0.4 periods; the acceleration grows like 1 / T^4.",
        ),
        Claim(
            "Below half a period the speed approaches the limit of the actuator, 1 m/s (abstract).",
            "1 m/s is reached at "
            + ", ".join(f"{periods:.3f} periods for {distance} m" for distance, periods in study.shortest.items()),
            "not decidable",
            "The paper does not give the distance. For 0.02 m it is so; for 0.1 m the limit is passed at 0.85 periods already, "
            f"and at 0.5 periods the speed is {smooth.velocity:.3g} m/s.",
        ),
        Claim(
            "The 3-4-5 polynomial leaves residual vibration at all five durations (figures 3c and 3d).",
            _over(study.polynomial),
            _verdict(min(residuals.relative[0] for residuals in study.polynomial.values()) > 1e-3),
            "Amplitude in the first mode over that of a step of the same distance.",
        ),
        Claim(
            "From about three periods on the residual is below 5 %, whatever the function (section 4).",
            "for good from " + ", ".join(f"{end:.2f} ({name})" for name, end in ends.items()) + " periods",
            _verdict(last <= 3.0),
            "Four profiles up to 5 periods. A step, which takes no time, is no such function.",
        ),
        Claim(
            "The residual is suppressed much more effectively than by the 3-4-5 polynomial (section 5).",
            f"{_over(study.nominal)} against {_over(study.polynomial)}; where all frequencies are 5 % higher than designed for: "
            f"{_over(study.stiffer)} against {_over(study.polynomial_stiffer)}",
            _verdict(all(study.nominal[r].relative[0] < 1e-3 * study.polynomial[r].relative[0] for r in DURATIONS)),
            "At the five durations. Off its design the S-curve leaves "
            + ("less, too." if off == len(DURATIONS) else f"less at {off} of them alone."),
        ),
    ]

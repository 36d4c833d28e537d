"""The claims of Kilic and Kapucu (2011), each with a verdict from the study's numbers."""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.reproduce.claims import Claim, Verdict
from shaper_fmu.reproduce.two_part.arm import ROD_LENGTH
from shaper_fmu.reproduce.two_part.compared import LONGER, LONGER_THAN_A_PERIOD, METHODS
from shaper_fmu.reproduce.two_part.runs import COMMANDS, DAMPING_RATIO, DISTANCE, DURATION, GRAVITY, NATURAL_FREQUENCY
from shaper_fmu.reproduce.two_part.study import ERRORS, LEVEL, RATIOS, Study


def claims(study: Study) -> list[Claim]:
    """All claims, in the paper's order."""
    return [*_model(study), *_command(study), *_responses(study), *_robustness(study), *_beyond(study)]


def percent(value: float) -> str:
    """A share as percents, three digits of it, or less than 0.001 %."""
    return "below 0.001 %" if value < 1e-5 else f"{100.0 * value:.3g} %"


def band_text(ends: tuple[float, float]) -> str:
    """A band of frequencies and its width."""
    return f"{ends[0]:.4f} to {ends[1]:.4f} ({ends[1] - ends[0]:.4f} wide)"


def width(ends: tuple[float, float]) -> float:
    """Width of a band."""
    return ends[1] - ends[0]


def _verdict(holds: bool) -> Verdict:
    return "reproduced" if holds else "not reproduced"


def _model(study: Study) -> list[Claim]:
    rod = math.sqrt(1.5 * GRAVITY / ROD_LENGTH)
    error = rod / NATURAL_FREQUENCY - 1.0
    worst = max(abs(a - b) for c in COMMANDS for a, b in zip(study.arm_bands[c], study.swings[c].band, strict=True))
    peaks = [abs(study.arm[c].peaks["arm.swing_angle"] / study.swings[c].peak - 1.0) for c in COMMANDS]
    return [
        Claim(
            "The hydraulic cylinder and the servo valve are assumed to be faster than the rest of the system (section 2).",
            f"peak swings within {percent(max(peaks))}, bands within {worst:.4f} of those of an exact drive",
            "not decidable",
            "The paper gives no data of its hydraulics. With a cylinder, valve and position loop of our choice (64 rad/s closed "
            "loop, "
            "11 times the pendulum) the assumption does no harm.",
        ),
        Claim(
            "The rod, 0.485 mm long (section 5), has a natural frequency of about 5.5045 rad/s.",
            f"{rod:.4f} rad/s for 0.485 m",
            _verdict(abs(error) < 0.01),
            "sqrt(3 g / (2 l)) of a uniform rod, which the plant's linearised motion has; mm is a misprint for m. Eq. (2) is "
            "that of a "
            f"point mass, which would need {GRAVITY / NATURAL_FREQUENCY**2:.4f} m for this frequency.",
        ),
    ]


def _command(study: Study) -> list[Claim]:
    worst = max(study.durations.values())
    return [
        Claim(
            "The amplitudes of eqs. (4) to (6) give a displacement without vibration at the end of the travel time (section 3).",
            f"V {percent(study.nominal['single'])} in {DURATION} s",
            _verdict(study.nominal["single"] < 1e-5),
            "MotionProfile on an oscillator with the designed mode; the rest is the master's, which holds the command over each "
            "step.",
        ),
        Claim(
            "In theory there is no restriction at all on the travel time of the reference (section 4).",
            f"V {percent(worst)} for {', '.join(f'{d:g}' for d in study.durations)} s",
            _verdict(worst < 1e-5),
            "The same, for a twelfth of a period and more. The speed, which jumps at both ends, sets the limit in practice.",
        ),
        Claim(
            "When the first part's motion is complete the vibration is gone, and the second begins under proper conditions "
            "(section 4).",
            f"V {percent(study.half)} after the first half",
            _verdict(study.half < 1e-5),
            "Each half is the profile of section 3 over half the distance and half the time.",
        ),
    ]


def _responses(study: Study) -> list[Claim]:
    single, double = study.swings["single"], study.swings["two-part"]
    arm = study.arm
    ratio = double.peak / single.peak
    return [
        Claim(
            "With the reference input the pendulum's swing is considerably reduced, as expected (section 5, figure 3).",
            f"residual swing {single.residual:.3g} rad (exact drive), V {percent(arm['single'].vibration)} on the hydraulic arm",
            _verdict(arm["single"].vibration < LEVEL),
            f"A step would leave {1.5 * DISTANCE / ROD_LENGTH:.3f} rad of small swings. The rest comes from the pendulum's "
            "nonlinearity, and on "
            "the arm from the rod's frequency, 0.07 % above the designed one.",
        ),
        Claim(
            "Simulation and experiment coincide (section 5, figures 3 and 4).",
            "no data",
            "not decidable",
            "The measurements are no part of the text that was at hand, and the parameters of the rig are not printed.",
        ),
        Claim(
            "There is no great difference between the swings with the proposed and with the reference input (section 5, figure 4).",
            f"peak swing {double.peak:.4f} against {single.peak:.4f} rad; afterwards {double.residual:.3g} against "
            f"{single.residual:.3g} rad",
            _verdict(ratio < 1.25),
            f"The two-part command swings the pendulum {ratio:.2f} times as far on the way, since it moves at up to "
            f"{study.shapes['two-part'].metrics['velocity']:.3f} m/s instead of {study.shapes['single'].metrics['velocity']:.3f} "
            "m/s. "
            "After the move both are at rest to less than 0.1 degrees.",
        ),
    ]


def _robustness(study: Study) -> list[Claim]:
    single, double = study.estimates["single"], study.estimates["two-part"]
    rises = bool(np.all(np.diff(single.curve[RATIOS > 1.0001]) > 0.0) and np.all(np.diff(single.curve[RATIOS < 0.9999]) < 0.0))
    factor, factor_arm = width(double.band) / width(single.band), width(double.arm_band) / width(single.arm_band)
    actual = {name: study.bands[name] for name in COMMANDS}
    factor_actual = width(actual["two-part"]) / width(actual["single"])
    better = [a < b for a, b in zip(double.errors, single.errors, strict=True)]
    everywhere = float(np.mean(double.curve <= single.curve + 1e-6))
    peaks = {name: study.shapes[name].metrics for name in COMMANDS}
    return [
        Claim(
            "With the reference input, changes of the natural frequency increase the residual vibration (section 5, figure 5).",
            f"V {_errors(single.errors)}",
            _verdict(rises),
            "Over the estimate w*/w, as eq. (7) has it: the command is designed for w*, the pendulum and the time stay. V rises on "
            f"both sides from 0.6 to 1.5; it is below 5 % from {band_text(single.band)}. Over the pendulum's own frequency, the "
            f"command staying as it is: from {band_text(actual['single'])}.",
        ),
        Claim(
            "With the proposed input there is a valley around the natural frequency: even with a wrong estimate the residual "
            "vibration is reduced very much (section 5, figure 6).",
            f"V {_errors(double.errors)}; below 5 % from {band_text(double.band)}",
            _verdict(factor > 2.0),
            f"Over the estimate w*/w; on the whole hydraulic arm from {band_text(double.arm_band)}. Over the pendulum's own "
            f"frequency the valley is {band_text(actual['two-part'])}. For a fixed time, estimate high rather than low. If the "
            f"time is chosen in periods of w* instead, low rather than high: then V is {_errors(double.in_periods)}.",
        ),
        Claim(
            "The robustness of the proposed input is far better than that of the reference input (section 5).",
            f"the band of w* is {factor:.2f} times as wide on the oscillator, {factor_arm:.2f} times on the hydraulic arm",
            _verdict(all(better) and factor > 2.0),
            f"Less residual at all of {', '.join(f'{r:g}' for r in ERRORS)}, and over {percent(everywhere)} of the range from "
            f"0.6 to 1.5. Over the pendulum's own frequency the band is {factor_actual:.2f} times as wide. Its price: overshoot of "
            f"{percent(peaks['two-part']['position'] / DISTANCE - 1.0)} on the way and "
            f"{peaks['two-part']['velocity'] / peaks['single']['velocity']:.1f} times the speed.",
        ),
    ]


def _errors(values: list[float]) -> str:
    return f"{', '.join(f'{100.0 * v:.2f}' for v in values)} % at w*/w = {', '.join(f'{r:g}' for r in ERRORS)}"


def _beyond(study: Study) -> list[Claim]:
    zv, zvd = study.bands["ZV"], study.bands["ZVD"]
    times = study.shaper_durations
    widths = {name: found[DURATION].width for name, found in study.compared.items() if DURATION in found}
    second = sorted(widths, key=lambda name: widths[name])[-2]
    later = {name: found[LONGER].width for name, found in study.compared.items()}
    low, high = study.estimates["two-part"].band
    return [
        Claim(
            "The system's damping ratio is negligibly small, so the robustness is examined for the natural frequency alone "
            "(section 5).",
            f"designed without damping: V {percent(study.undamped['single'])} single, {percent(study.undamped['two-part'])} "
            "two-part",
            _verdict(max(study.undamped.values()) < LEVEL),
            f"A damping ratio of {DAMPING_RATIO} is not negligible for the single command, which leaves more than 5 % without it.",
        ),
        Claim(
            "The proposed method was also seen to be better than other methods of reference [10] (section 5).",
            f"V below 5 % over {widths['two-part']:.3f} in w*/w; the next of the others, {second}: {widths[second]:.3f}",
            _verdict(max(widths, key=lambda name: widths[name]) == "two-part"),
            "The list of references is not part of the text that was at hand; tried are the methods that this paper and Taskin, "
            f"Kilic and Kapucu (2019) name, {len(METHODS)} with their own, of which {len(LONGER_THAN_A_PERIOD)} cannot move in "
            "less than a period. It holds for the paper's time of 0.85 periods. In 1.5 periods the single command's band is "
            f"{later['single']:.3f} wide and the two-part one's {later['two-part']:.3f}: to first order it is better in less than "
            "sqrt(8/5) = 1.265 periods alone. Of the usual shapers, ZV "
            f"(in {times['ZV']:.3f} s) has a band of {width(zv):.3f} of the pendulum's own frequency, and ZVD one as wide as the "
            f"two-part command's, {width(zvd):.3f}, evenly about the designed one; it takes "
            f"{times['ZVD'] / DURATION - 1.0:.0%} longer, but does not overshoot.",
        ),
        Claim(
            "The vibration can be held at a certain level although the natural frequency was estimated with some error (section "
            "6).",
            f"V below 5 % for estimates {percent(1.0 - low)} below to {percent(high - 1.0)} above the frequency (two-part)",
            _verdict(low < 0.95 and high > 1.05),
            "In simulation, for an error of 5 % and more either way. The experiments that the paper also refers to cannot be run "
            "again.",
        ),
    ]

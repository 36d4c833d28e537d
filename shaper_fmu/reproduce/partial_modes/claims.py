"""The claims of Jung (2011), in the paper's order, with the results of the FMUs.

Where a claim speaks of the first or second mode it is tried as printed (3.85 rad/s is the first) and with the labels swapped.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.reproduce.claims import Claim, Verdict
from shaper_fmu.reproduce.partial_modes.runs import Case
from shaper_fmu.reproduce.partial_modes.study import Study

_ALIKE = 0.10
"""Two figures are called alike where they differ by less than this share, or this many parts of the way."""
_AS_PRINTED = "as printed"
_SWAPPED = "labels swapped"


def claims(found: Study) -> list[Claim]:
    """Every claim of the paper with its verdict."""
    return [*_setting(found), *_unshaped(found), *_first_mode(found), *_second_mode(found), *_commands(found), *_conclusions(found)]


def _verdict(holds: bool) -> Verdict:
    return "reproduced" if holds else "not reproduced"


def _setting(found: Study) -> list[Claim]:
    (w1, z1), (w2, z2) = found.modes
    return [
        Claim(
            "Eqs. (7), (8): the impulses 1/(1 + K) and K/(1 + K) with K = exp(zeta pi / sqrt(1 - zeta^2)) leave no vibration",
            f"V = {found.by_printed_formula[0]:.2f} % and {found.by_printed_formula[1]:.2f} % of the modes of eq. (11)",
            _verdict(max(found.by_printed_formula) < 0.1),
            "A custom shaper FMU on oscillator FMUs. The two impulses are exchanged: with K = exp(-zeta pi / sqrt(1 - zeta^2)) "
            "nothing is left, and that is what is used below.",
        ),
        Claim(
            "Eq. (11): natural frequencies 3.85 and 9.42 rad/s, damping ratios 0.096 and 0.24",
            f"{w1:.4f} and {w2:.4f} rad/s, {z1:.4f} and {z2:.4f}",
            "not decidable",
            "The masses and springs of Fig. 3 and the controller are not in the text. Masses 15, 8, 10 kg, springs 400, 120 N/m "
            "and dampers of 1/20 s times the springs have these modes; F = 300 (r - x1) - 50 v1 is one of few controllers for "
            "which the conclusion holds at all.",
        ),
    ]


def _unshaped(found: Study) -> list[Claim]:
    case = found.cases["none"]
    one, two, _ = case.positions
    alike = float(np.corrcoef(one - 1.0, two - 1.0)[0, 1])
    return [
        Claim(
            "Fig. 4: in spite of the control x1 oscillates",
            f"overshoot {case.overshoot[0]:.1f} %",
            _verdict(case.overshoot[0] > 10.0),
            "A step through the loop without shaper.",
        ),
        Claim(
            "Fig. 4: x1 does not reach the steady state",
            f"within 2 % after {case.settled2[0]:.2f} s",
            _verdict(not np.isfinite(case.settled2[0])),
            "All poles of the loop decay, so it does; any chain with the damping ratios of eq. (11) under a stable loop does.",
        ),
        Claim(
            "Fig. 4: x2 responds in a pattern similar to x1",
            f"correlation {alike:.3f}",
            _verdict(alike > 0.9),
            "Of the deviations from the end position over the whole run.",
        ),
        Claim(
            "Fig. 4: x3 sways as if there were no controller",
            f"overshoot {case.overshoot[2]:.1f} %, within 5 % after {case.settled5[2]:.1f} s",
            _verdict(case.overshoot[2] > 80.0),
            "It swings to twice the way and back.",
        ),
        Claim(
            "Section 3: the delays of the two modes' shapers add up",
            f"{found.cases['fast'].duration:.4f} s + {found.cases['slow'].duration:.4f} s = {found.cases['both'].duration:.4f} s",
            _verdict(abs(found.cases["both"].duration - found.cases["fast"].duration - found.cases["slow"].duration) < 1e-9),
            "The durations that the shaper FMU calculates.",
        ),
    ]


def _first_mode(found: Study) -> list[Claim]:
    rows = []
    none = found.cases["none"]
    for label, name, w in ((_AS_PRINTED, "slow", "3.85"), (_SWAPPED, "fast", "9.42")):
        ratio = found.cases[name].overshoot[0] / none.overshoot[0]
        rows.append(
            Claim(
                f"Fig. 5: with the first mode only, x1 overshoots as without shaping ({label}: {w} rad/s)",
                f"{ratio:.3f} of the unshaped overshoot",
                _verdict(ratio > 0.8),
                f"{found.cases[name].overshoot[0]:.1f} % and {none.overshoot[0]:.1f} %.",
            )
        )
    return rows


def _second_mode(found: Study) -> list[Claim]:
    rows = []
    both = found.cases["both"]
    for label, name, w in ((_AS_PRINTED, "fast", "9.42"), (_SWAPPED, "slow", "3.85")):
        case = found.cases[name]
        rows += [_like_both(case, both, 0, f"Fig. 5: with the second mode only, x1 responds like with both ({label}: {w} rad/s)")]
        later = case.settled5[1] / both.settled5[1] - 1.0
        rows.append(
            Claim(
                f"Fig. 6: with the second mode only, x2 settles almost as with both ({label}: {w} rad/s)",
                f"time to 5 % {later:+.0%}",
                _verdict(abs(later) <= _ALIKE),
                f"{case.settled5[1]:.3f} s and {both.settled5[1]:.3f} s.",
            )
        )
        rows += [_like_both(case, both, 2, f"Fig. 7: the same tendency for x3 ({label}: {w} rad/s)")]
    return rows


def _like_both(case: Case, both: Case, j: int, statement: str) -> Claim:
    more = case.overshoot[j] - both.overshoot[j]
    later = case.settled5[j] / both.settled5[j] - 1.0
    return Claim(
        statement,
        f"overshoot {case.overshoot[j]:.1f} % and {both.overshoot[j]:.1f} %, time to 5 % {later:+.0%}",
        _verdict(abs(more) <= 100.0 * _ALIKE and abs(later) <= _ALIKE),
        f"Called alike within {_ALIKE:.0%}: {case.settled5[j]:.3f} s and {both.settled5[j]:.3f} s.",
    )


def _commands(found: Study) -> list[Claim]:
    steps = {name: case.steps for name, case in found.printed.items()}
    counts = [len(steps[name]) for name in ("slow", "fast", "both")]
    last = {name: steps[name][-1][0] for name in steps}
    return [
        Claim(
            "Figs. 8 to 10: the shaped steps have 3, 3 and 9 steps",
            ", ".join(map(str, counts)),
            _verdict(counts == [3, 3, 9]),
            "Jumps of the shaper FMU's output for the modes of eq. (11): so the shapers are ZVD, though section 2 derives ZV.",
        ),
        *(
            Claim(
                f"Figs. 9 and 10: the last steps for the second mode and for both are very close ({label})",
                f"{last[name]:.3f} s and {last['both']:.3f} s",
                _verdict(abs(last[name] / last["both"] - 1.0) <= _ALIKE),
                "The printed modes settle this, whatever the masses are."
                + (" Of the two readings this is the nearer one." if label == _SWAPPED else ""),
            )
            for label, name in ((_AS_PRINTED, "fast"), (_SWAPPED, "slow"))
        ),
        *_s_shaped(found),
    ]


def _s_shaped(found: Study) -> list[Claim]:
    rows = []
    peaks = {name: case.overshoot[0] for name, case in found.s_shaped.items()}
    for label, first, second in ((_AS_PRINTED, "slow", "fast"), (_SWAPPED, "fast", "slow")):
        confirmed = peaks[first] > 0.8 * peaks["none"] and abs(peaks[second] - peaks["both"]) <= 100.0 * _ALIKE
        rows.append(
            Claim(
                f"Section 3: an S-shaped command confirms that the second mode alone will do ({label})",
                f"x1 overshoots {peaks['none']:.1f} %, with the first mode {peaks[first]:.1f} %, the second {peaks[second]:.1f} %, "
                f"both {peaks['both']:.1f} %",
                _verdict(confirmed),
                "A cycloid of 1 s; the paper prints neither its law nor its duration.",
            )
        )
    return rows


def _conclusions(found: Study) -> list[Claim]:
    both, slow = found.cases["both"], found.cases["slow"]
    shorter = 1.0 - slow.duration / both.duration
    later = slow.settled5 / both.settled5 - 1.0
    chosen = found.chosen["zvd", 0.05].chosen
    cured = found.cure[chosen.modes]
    return [
        Claim(
            "Conclusion: shaping the mode farthest from the control loop alone removes residual vibration much like shaping all",
            f"times to 5 % {later[0]:+.0%}, {later[1]:+.0%}, {later[2]:+.0%} (x1, x2, x3)",
            _verdict(bool((np.abs(later) <= _ALIKE).all())),
            "The mode of 3.85 rad/s, in which the farthest mass sways most: x1 and x3 yes, x2 no.",
        ),
        Claim(
            "Abstract: the wanted motion without exciting the modes that are not controlled",
            f"with both modes shaped x3 still overshoots by {both.overshoot[2]:.1f} %",
            _verdict(both.overshoot[2] < 100.0 * _ALIKE),
            f"The shaper stands before the loop, whose modes are others. With ZVD on two of these, chosen for 5 %, x3 overshoots "
            f"by {cured.overshoot[2]:.1f} % and is within 5 % after {cured.settled5[2]:.2f} s, not {both.settled5[2]:.2f} s.",
        ),
        Claim(
            "Conclusion: the delay that several modes bring is made up for in part",
            f"the shaper is {shorter:.1%} shorter; times to 5 % {later[0]:+.0%}, {later[1]:+.0%}, {later[2]:+.0%} (x1, x2, x3)",
            _verdict(bool((later < -_ALIKE).all())),
            f"{slow.duration:.3f} s in the place of {both.duration:.3f} s, but nothing settles sooner than by a few percent.",
        ),
    ]

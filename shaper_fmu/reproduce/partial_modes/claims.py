"""The claims of Jung (2011), in the paper's order, with the results of the FMUs: one row for each statement.

The paper prints neither masses nor gains, so what depends on them is tried with two sets, and the row says for which it holds. A
statement about the first or second mode is tried as printed (3.85 rad/s is the first) and with the labels exchanged; the verdict
says which reading it is that holds. Measures decide that do not jump; settling times stand beside them with their bands.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.reproduce.claims import Claim
from shaper_fmu.reproduce.partial_modes.judged import (
    ALIKE,
    AS_PRINTED,
    EXCHANGED,
    alike,
    by_labels,
    each,
    for_some,
    holds_for,
    left_share,
    overshoots,
    sentence,
    verdict_of,
)
from shaper_fmu.reproduce.partial_modes.runs import Case
from shaper_fmu.reproduce.partial_modes.study import Found, Study


def claims(study: Study) -> list[Claim]:
    """Every claim of the paper with its verdict."""
    return [
        _abstract(study), *_setting(study), *_unshaped(study), _delays(study), *_partial(study), *_commands(study),
        _s_shaped(study), *_conclusions(study),
    ]  # fmt: skip


def _percents(values: np.ndarray, sign: str = "") -> str:
    return " / ".join(f"{value:{sign}.1f}" for value in values) + " %"


def _abstract(study: Study) -> Claim:
    def still(found: Found) -> bool:
        return found.cases["both"].overshoot[2] < 100.0 * ALIKE

    chosen = study.chosen["zvd", 0.05].chosen
    cured, both = study.cure[chosen.modes], study.default.cases["both"]
    return Claim(
        "Abstract: the wanted motion without exciting the modes that are not controlled",
        f"overshoot of x3 with both modes shaped, {overshoots(study, 'both', 2)}",
        for_some(study, still),
        f"It {holds_for(study, still)}. The shaper stands before the loop, whose modes are others. With ZVD on two of these, "
        f"chosen for 5 %, x3 of set A overshoots by {cured.overshoot[2]:.1f} % and is within 5 % after {cured.settled5[2]:.2f} s, "
        f"not {both.settled5[2]:.2f} s.",
    )


def _setting(study: Study) -> list[Claim]:
    def modes(found: Found) -> str:
        (w1, z1), (w2, z2) = found.modes
        return f"{w1:.4f} and {w2:.4f} rad/s, {z1:.4f} and {z2:.4f}"

    a, b = (found.machine for found in study.found)
    return [
        Claim(
            "Eqs. (7), (8): the impulses 1/(1 + K) and K/(1 + K) with K = exp(zeta pi / sqrt(1 - zeta^2)) leave no vibration",
            f"V = {study.by_printed_formula[0]:.2f} % and {study.by_printed_formula[1]:.2f} % of the modes of eq. (11)",
            verdict_of(max(study.by_printed_formula) < 0.1),
            "A custom shaper FMU on oscillator FMUs. Eq. (8) has the two impulses exchanged against eq. (7), whose first one is "
            "K/(1 + K): with that nothing is left, and that is what is used below.",
        ),
        Claim(
            "Eq. (11): natural frequencies 3.85 and 9.42 rad/s, damping ratios 0.096 and 0.24",
            each(study, modes),
            "not decidable",
            "The masses and springs of Fig. 3 and the controller are not in the text. Two sets have these modes, with dampers of "
            f"1/20 s times the springs: {a.name} with {a.described()}; {b.name} with {b.described()}, which was searched for and "
            "meets nearly all of the paper's statements.",
        ),
    ]


def _unshaped(study: Study) -> list[Claim]:
    def similar(found: Found) -> float:
        one, two, _ = found.cases["none"].positions
        return float(np.corrcoef(one - 1.0, two - 1.0)[0, 1])

    def like(found: Found) -> bool:
        return similar(found) > 0.9

    def swings(found: Found) -> bool:
        return found.cases["none"].overshoot[0] > 10.0

    def sways(found: Found) -> bool:
        return found.cases["none"].overshoot[2] > 80.0

    def settled(found: Found) -> str:
        return f"{found.cases['none'].settled2[0]:.1f} s"

    return [
        Claim(
            "Fig. 4: in spite of the control x1 oscillates",
            f"overshoot {overshoots(study, 'none', 0)}",
            for_some(study, swings),
            f"A step through the loop without shaper; it {holds_for(study, swings)}.",
        ),
        Claim(
            "Fig. 4: x1 does not reach the steady state",
            f"within 2 % after {each(study, settled)}",
            "not decidable",
            "The figure and the length of its time axis are not in the text. In the end x1 comes to rest: any chain with the "
            "damping ratios of eq. (11) under a stable loop does.",
        ),
        Claim(
            "Fig. 4: x2 responds in a pattern similar to x1",
            f"correlation {each(study, lambda found: f'{similar(found):.3f}')}",
            for_some(study, like),
            f"Of the deviations from the end position over the whole run; it {holds_for(study, like)}.",
        ),
        Claim(
            "Fig. 4: x3 sways as if there were no controller",
            f"overshoot {overshoots(study, 'none', 2)}",
            for_some(study, sways),
            f"It swings to nearly twice the way and back; it {holds_for(study, sways)}.",
        ),
    ]


def _delays(study: Study) -> Claim:
    def text(found: Found) -> str:
        return (
            " + ".join(f"{found.cases[name].duration:.4f}" for name in ("fast", "slow"))
            + f" = {found.cases['both'].duration:.4f} s"
        )

    def add_up(found: Found) -> bool:
        return abs(found.cases["both"].duration - found.cases["fast"].duration - found.cases["slow"].duration) < 1e-9

    return Claim(
        "Section 3: the delays of the two modes' shapers add up",
        each(study, text),
        verdict_of(all(add_up(found) for found in study.found)),
        "The durations that the shaper FMU calculates, for each set's own modes.",
    )


def _partial(study: Study) -> list[Claim]:
    def overshoot(found: Found, labels: dict[str, str]) -> float:
        return float(found.cases[labels["first"]].overshoot[0] / found.cases["none"].overshoot[0])

    verdict, which = by_labels(study, lambda found, labels: overshoot(found, labels) > 0.8)
    return [
        Claim(
            "Fig. 5: with the first mode only, x1 overshoots as without shaping",
            f"share of the unshaped overshoot, with 9.42 rad/s only, {each(study, lambda f: f'{overshoot(f, EXCHANGED):.3f}')}; "
            f"with 3.85 rad/s only, {each(study, lambda f: f'{overshoot(f, AS_PRINTED):.3f}')}",
            verdict,
            sentence(which),
        ),
        _like_both(study, 0, "Fig. 5: with the second mode only, x1 responds like with both"),
        _like_both(study, 1, "Fig. 6: with the second mode only, x2 settles almost as with both"),
        _like_both(study, 2, "Fig. 7: the same tendency for x3"),
    ]


def _like_both(study: Study, j: int, statement: str) -> Claim:
    def text(found: Found, name: str) -> str:
        one, both = found.cases[name], found.cases["both"]
        left, left_both = (100.0 * left_share(found, case)[j] for case in (one, both))
        return (
            f"left {left:.1f} and {left_both:.1f} %, envelope within 5 % {_later(one, both, 'enveloped5', j)}, "
            f"overshoot {one.overshoot[j]:.1f} and {both.overshoot[j]:.1f} %"
        )

    def settled(found: Found) -> str:
        one, both = found.cases["slow"], found.cases["both"]
        return f"{_later(one, both, 'settled5', j)} to 5 %, {_later(one, both, 'settled2', j)} to 2 %"

    verdict, which = by_labels(study, lambda found, labels: alike(found, labels["second"], j))
    return Claim(
        statement,
        f"with 3.85 rad/s only and with both, {each(study, lambda found: text(found, 'slow'))}",
        verdict,
        f"{sentence(which)} With 9.42 rad/s only, {each(study, lambda found: text(found, 'fast'))}. Alike is within {ALIKE:.0%} of "
        f"the way and of the time. Settling with 3.85 rad/s, {each(study, settled)}: these times jump where a swing just touches "
        "the band.",
    )


def _later(one: Case, both: Case, what: str, j: int) -> str:
    return f"{getattr(one, what)[j] / getattr(both, what)[j] - 1.0:+.0%}"


def _commands(study: Study) -> list[Claim]:
    printed = study.default.printed
    steps = {name: printed[name].steps for name in ("slow", "fast", "both")}
    counts = [len(one) for one in steps.values()]
    last = {name: one[-1][0] for name, one in steps.items()}
    near = {name: abs(last[name] / last["both"] - 1.0) <= ALIKE for name in ("slow", "fast")}
    return [
        Claim(
            "Figs. 8 to 10: the shaped steps have 3, 3 and 9 steps",
            ", ".join(map(str, counts)),
            verdict_of(counts == [3, 3, 9]),
            "Jumps of the shaper FMU's output for the modes of eq. (11), whatever the masses are: so the shapers are ZVD, though "
            "section 2 derives ZV.",
        ),
        Claim(
            "Figs. 9 and 10: the last steps for the second mode and for both are very close",
            f"{last['fast']:.3f} s and {last['both']:.3f} s as printed, {last['slow']:.3f} s and {last['both']:.3f} s exchanged",
            "reproduced" if near["fast"] else "reproduced (labels exchanged)" if near["slow"] else "not reproduced",
            "The printed modes settle this, whatever the masses are. With the labels exchanged they are nearer to each other.",
        ),
    ]


def _s_shaped(study: Study) -> Claim:
    def confirmed(found: Found, labels: dict[str, str]) -> bool:
        peak = {name: case.overshoot[0] for name, case in found.s_shaped.items()}
        return bool(peak[labels["first"]] > 0.8 * peak["none"] and abs(peak[labels["second"]] - peak["both"]) <= 100.0 * ALIKE)

    def text(found: Found) -> str:
        return " / ".join(f"{found.s_shaped[name].overshoot[0]:.1f}" for name in ("none", "fast", "slow", "both")) + " %"

    verdict, which = by_labels(study, confirmed)
    return Claim(
        "Section 3: an S-shaped command confirms that the second mode alone will do",
        f"overshoot of x1 with no mode / 9.42 / 3.85 rad/s / both, {each(study, text)}",
        verdict,
        f"{sentence(which)} A cycloid of 1 s; the paper prints neither its law nor its duration.",
    )


def _conclusions(study: Study) -> list[Claim]:
    def enough(found: Found, labels: dict[str, str]) -> bool:
        return all(alike(found, labels["second"], j) for j in range(3))

    def sooner(found: Found, labels: dict[str, str]) -> bool:
        one, both = found.cases[labels["second"]], found.cases["both"]
        return bool(enough(found, labels) and one.duration < both.duration and (one.rise < both.rise).all())

    def left(found: Found) -> str:
        return " and ".join(_percents(100.0 * left_share(found, found.cases[name])) for name in ("slow", "both"))

    def rise(found: Found) -> str:
        return _percents(100.0 * (found.cases["slow"].rise / found.cases["both"].rise - 1.0), "+")

    def settled(found: Found) -> str:
        return _percents(100.0 * (found.cases["slow"].settled5 / found.cases["both"].settled5 - 1.0), "+")

    slow, both = study.default.cases["slow"], study.default.cases["both"]
    verdict, which = by_labels(study, enough)
    in_part, which_in_part = by_labels(study, sooner)
    return [
        Claim(
            "Conclusion: shaping the mode farthest from the control loop alone removes residual vibration much like shaping all",
            f"left of x1 / x2 / x3 with 3.85 rad/s only and with both, {each(study, left)}",
            verdict,
            f"{sentence(which)} The farthest mass sways most in the mode of 3.85 rad/s, which eq. (11) calls the first.",
        ),
        Claim(
            "Conclusion: the delay that several modes bring is made up for in part",
            f"length of the shaper {slow.duration / both.duration - 1.0:+.1%}; time to 90 % of the way, x1 / x2 / x3, "
            f"{each(study, rise)}",
            in_part,
            f"{sentence(which_in_part)} {slow.duration:.3f} s in the place of {both.duration:.3f} s. Beside it, "
            f"settling to 5 %, {each(study, settled)}.",
        ),
    ]

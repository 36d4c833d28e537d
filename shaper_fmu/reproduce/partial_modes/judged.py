"""How a statement of Jung (2011) is judged: for which set of masses and gains, and with which labels of the modes, it holds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shaper_fmu.reproduce.claims import Verdict
from shaper_fmu.reproduce.partial_modes.runs import Case
from shaper_fmu.reproduce.partial_modes.study import Found, Study

ALIKE = 0.10
"""Two figures are called alike where they differ by less than this share, or this many parts of the way."""
AS_PRINTED = {"first": "slow", "second": "fast"}
EXCHANGED = {"first": "fast", "second": "slow"}

Test = Callable[[Found], bool]


def verdict_of(holds: bool) -> Verdict:
    return "reproduced" if holds else "not reproduced"


def holds_for(study: Study, test: Test) -> str:
    """For which sets it holds, as a text."""
    names = [f"set {found.machine.name}" for found in study.found if test(found)]
    return f"holds for {' and '.join(names)}" if names else "holds for neither set"


def each(study: Study, text: Callable[[Found], str]) -> str:
    return "; ".join(f"{found.machine.name}: {text(found)}" for found in study.found)


def overshoots(study: Study, name: str, j: int) -> str:
    return each(study, lambda found: f"{found.cases[name].overshoot[j]:.1f} %")


def sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def for_some(study: Study, test: Test) -> Verdict:
    return verdict_of(any(test(found) for found in study.found))


def by_labels(study: Study, test: Callable[[Found, dict[str, str]], bool]) -> tuple[Verdict, str]:
    """The verdict of a statement about the first or second mode, and for which sets it holds."""
    if any(test(found, AS_PRINTED) for found in study.found):
        return "reproduced", holds_for(study, lambda found: test(found, AS_PRINTED))
    exchanged = holds_for(study, lambda found: test(found, EXCHANGED))
    some = any(test(found, EXCHANGED) for found in study.found)
    return ("reproduced (labels exchanged)" if some else "not reproduced"), f"as printed for neither set; exchanged it {exchanged}"


def alike(found: Found, name: str, j: int) -> bool:
    """Whether a mass responds with one mode shaped as with both: in what is left, in its envelope and in its overshoot."""
    one, both = found.cases[name], found.cases["both"]
    return bool(
        abs(left_share(found, one)[j] - left_share(found, both)[j]) <= ALIKE
        and abs(one.enveloped5[j] / both.enveloped5[j] - 1.0) <= ALIKE
        and abs(one.overshoot[j] - both.overshoot[j]) <= 100.0 * ALIKE
    )


def left_share(found: Found, case: Case) -> np.ndarray:
    """What is left of each mass's deviation after the last impulse of both modes' shaper, over all without shaping; shape (3,).

    The square root of the energies' ratio, so that it is a share of the amplitude.
    """
    return np.sqrt(case.energy(found.cases["both"].duration) / found.cases["none"].energy())

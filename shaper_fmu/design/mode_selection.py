"""Selects the modes to shape: the shortest shaper within a tolerated residual, instead of one for all modes.

For a set of modes with a shaper for each, of the total duration D, the residual is rho = max_j sup |x_j - x_j(infinity)| /
|x_j(infinity)| after the last impulse. A further shaper of positive impulses that add up to 1 never raises it: it makes x_j
a convex combination of itself at the same and later times. So sets are enumerated by rising duration, the first one that is
good enough is the shortest; a mode without which all others together are not good enough is mandatory; and if all modes
together are not good enough, nothing is.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence, convolve_all
from shaper_fmu.design.modal_responses import ModalResponse
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ArgumentError

Objective = Literal["duration", "settling"]
MOST_EXAMINED = 2000
MOST_IMPULSES = 20_000
"""How many sets are examined at most, and how many impulses all sets may have: so that a selection takes seconds."""

_ROUNDING = 1e-12
Choice = tuple[str | None, ...]
"""The kind of shaper for each mode that can be shaped, None for a mode that is left alone."""


@dataclass(frozen=True)
class ModeSet:
    """A set of shaped modes and its result.

    Attributes:
        modes: indices into the response's poles.
        kinds: the kind of shaper of each of these modes.
        shaper: their shapers, convolved; its duration is D.
        residual: rho, from the last impulse on.
    """

    modes: tuple[int, ...]
    kinds: tuple[str, ...]
    shaper: ImpulseSequence
    residual: float

    @property
    def duration(self) -> float:
        """Delay of the last impulse [s]."""
        return self.shaper.duration


@dataclass(frozen=True)
class Selection:
    """The result of `select_modes`.

    Attributes:
        chosen: the best set; where none is good enough, the one of all modes with the least residual.
        feasible: whether its residual is within the tolerance; for the earliest settling, always.
        mandatory: modes without which no set is good enough.
        full: the shortest set of all modes, to compare with.
        settling_time: of the chosen set, into the band of the tolerance, of the slowest output [s].
        examined: how many sets were examined.
        reason: all this in a sentence.
    """

    chosen: ModeSet
    feasible: bool
    mandatory: tuple[int, ...]
    full: ModeSet
    settling_time: float
    examined: int
    reason: str


def select_modes(
    response: ModalResponse,
    kinds: str | Sequence[str] = "zvd",
    tolerance: float = 0.05,
    *,
    objective: Objective = "duration",
    **options: float,
) -> Selection:
    """The shortest shaper over any of the modes that leaves a residual rho <= `tolerance`.

    Args:
        response: of the system as the shaper drives it: for a shaper before a feedback loop that of the closed loop.
        kinds: a shaper for each selected mode, a name of `Shaper`; of several, each mode may use another one.
        tolerance: of rho, 0 < tolerance < 1.
        objective: "settling" minimises instead the time after which all outputs stay within `tolerance` of their final values.
        options: vibration_tolerance and parameters of the shapers, see `shaper`.

    Equal to the best of all sets. With positive shapers, few sets are examined for the duration; else all of them are.
    Raises ArgumentError for values outside their domain, and if more than `MOST_EXAMINED` sets (for the settling time:
    `MOST_IMPULSES` of all sets together) would have to be examined.
    """
    if not 0.0 < tolerance < 1.0:
        raise ArgumentError(f"tolerance = {tolerance} is outside its domain 0 < tolerance < 1")
    if objective not in ("duration", "settling"):
        raise ArgumentError(f"there is no objective {objective!r}; use 'duration' or 'settling'")
    search = _Search(response, distinct_kinds(kinds), options)
    if objective == "settling":
        return search.earliest_settling(tolerance)
    return search.shortest(tolerance)


def mode_sets(response: ModalResponse, kind: str = "zvd", **options: Any) -> list[ModeSet]:
    """All 2^n sets of the modes that can be shaped, each with this kind of shaper, by rising duration.

    `options` are those of `shaper`. Raises ArgumentError for sets of more than `MOST_IMPULSES` together.
    """
    search = _Search(response, distinct_kinds(kind), options)
    search.check_count()
    return [search.measured(choice) for choice in search.by_duration()]


class _Search:
    """The modes of a response and the shapers for them."""

    def __init__(self, response: ModalResponse, kinds: tuple[str, ...], options: dict):
        self.response, self.kinds, self.examined = response, kinds, 0
        frequency, ratio = response.natural_frequency, response.damping_ratio
        self.shapers = [{kind: shaper(kind, frequency[k], ratio[k], **options) for kind in kinds} for k in response.modes]
        self.left = [{kind: response.remaining(one) for kind, one in found.items()} for found in self.shapers]
        self.positive = all(min(one.amplitudes) >= 0.0 for found in self.shapers for one in found.values())
        self.none = (None,) * len(self.shapers)

    def sequence(self, choice: Choice) -> ImpulseSequence:
        return convolve_all([found[kind] for found, kind in zip(self.shapers, choice, strict=True) if kind is not None])

    def measured(self, choice: Choice) -> ModeSet:
        sequence = self.sequence(choice)
        modes = tuple(k for k, kind in zip(self.response.modes, choice, strict=True) if kind is not None)
        kinds = tuple(kind for kind in choice if kind is not None)
        return ModeSet(modes, kinds, sequence, self.response.residual(sequence)[1])

    def feasible(self, kinds: Sequence[Sequence[str]], tolerance: float) -> bool:
        """Whether the residual is within the tolerance, for certain, but for rounding; `kinds` for each mode, any number."""
        self.examined += 1
        if self.examined > MOST_EXAMINED:
            raise ArgumentError(
                f"more than {MOST_EXAMINED} sets of modes would have to be examined; give fewer modes or fewer kinds of shapers"
            )
        left = np.ones(len(self.response.poles), complex)
        for known, of_mode in zip(self.left, kinds, strict=True):
            for kind in of_mode:
                left = left * known[kind]
        return self.response.residual_of(left, tolerance + _ROUNDING)[1] <= tolerance + _ROUNDING

    def by_duration(self, mandatory: frozenset[int] = frozenset()) -> Iterator[Choice]:
        """All choices that shape the `mandatory` modes (numbered like self.shapers), by rising total duration; lazily.

        Best first: from each choice the next longer option of one mode, at or behind the last one that was changed.
        """
        ladders = [self._ladder(i, i in mandatory) for i in range(len(self.shapers))]
        start = (0,) * len(ladders)
        heap: list[tuple[float, tuple[int, ...], int]] = [(sum(ladder[0][0] for ladder in ladders), start, 0)]
        while heap:
            _, at, first = heapq.heappop(heap)
            yield tuple(ladder[i][1] for ladder, i in zip(ladders, at, strict=True))
            for place in range(first, len(at)):
                if at[place] + 1 < len(ladders[place]):
                    then = (*at[:place], at[place] + 1, *at[place + 1 :])
                    total = sum(ladder[i][0] for ladder, i in zip(ladders, then, strict=True))
                    heapq.heappush(heap, (total, then, place))

    def _ladder(self, number: int, mandatory: bool) -> list[tuple[float, str | None]]:
        """The options of a mode by rising duration: (duration [s], kind)."""
        options: list[tuple[float, str | None]] = sorted((one.duration, kind) for kind, one in self.shapers[number].items())
        return options if mandatory else [(0.0, None), *options]

    def check_count(self) -> None:
        """Raise ComponentError where all sets together are more, or have more impulses, than can be examined."""
        impulses = math.prod(1 + sum(len(one.delays) for one in found.values()) for found in self.shapers)
        if impulses > MOST_IMPULSES:
            raise ArgumentError(
                f"all sets of {len(self.shapers)} modes have {impulses} impulses, more than the {MOST_IMPULSES} that are examined; "
                "give fewer modes or fewer kinds of shapers"
            )

    def shortest(self, tolerance: float) -> Selection:
        mandatory: list[int] = []
        possible = True
        if self.positive:  # all kinds for all modes at once: no set leaves less
            everything = [self.kinds] * len(self.shapers)
            possible = self.feasible(everything, tolerance)
            if possible:
                for i in range(len(everything)):
                    if not self.feasible([*everything[:i], (), *everything[i + 1 :]], tolerance):
                        mandatory.append(i)
        chosen = None
        if possible:
            for choice in self.by_duration(frozenset(mandatory)):
                if self.feasible([() if kind is None else (kind,) for kind in choice], tolerance):
                    chosen = self.measured(choice)
                    break
        return self._selection(chosen, tolerance, mandatory, "shortest")

    def earliest_settling(self, tolerance: float) -> Selection:
        self.check_count()
        best, best_time = self.none, np.inf
        for choice in self.by_duration():
            self.examined += 1
            time = float(self.response.settling_time(self.sequence(choice), tolerance).max())
            if time < best_time:
                best, best_time = choice, time
        return self._selection(self.measured(best), tolerance, [], "earliest to settle")

    def _selection(self, chosen: ModeSet | None, tolerance: float, mandatory: Sequence[int], heading: str) -> Selection:
        full = self._full()
        best = chosen or full[1]
        modes = self.response.modes
        settling = float(self.response.settling_time(best.shaper, tolerance).max())
        selection = Selection(
            best, chosen is not None, tuple(modes[i] for i in mandatory), full[0],
            settling, self.examined, "",
        )  # fmt: skip
        reason = _reason(self.response, selection, chosen is not None, tolerance, heading)
        return Selection(**{**vars(selection), "reason": reason})

    def _full(self) -> tuple[ModeSet, ModeSet]:
        """Of the sets of all modes (as many as may be examined) the shortest, and the one with the least residual."""
        every = frozenset(range(len(self.shapers)))
        first = least = None
        for count, choice in enumerate(self.by_duration(every)):
            found = self.measured(choice)
            first = first or found
            least = found if least is None or found.residual < least.residual else least
            if count >= 100:
                break
        assert first is not None
        return first, least or first


def distinct_kinds(kinds: str | Sequence[str]) -> tuple[str, ...]:
    """The kinds, each once. Raises ArgumentError if there are none, or if one is not a shaper."""
    found = tuple(dict.fromkeys([kinds] if isinstance(kinds, str) else kinds))
    if not found:
        raise ArgumentError("give at least one kind of shaper")
    if "none" in found:
        raise ArgumentError("'none' is not a kind of shaper to choose from: every mode may be left alone anyway")
    return found


def _reason(response: ModalResponse, selection: Selection, found: bool, tolerance: float, heading: str) -> str:
    """The reason for the selection."""
    chosen, full = selection.chosen, selection.full

    kinds = f" ({', '.join(chosen.kinds)})" if len(set(chosen.kinds)) > 1 else ""

    def shown(modes: Sequence[int]) -> str:
        return ", ".join(f"{response.natural_frequency[k]:.5g}" for k in modes) + " rad/s" if len(modes) else "no mode"

    if not found:
        return (
            f"infeasible: even all modes shaped leave rho = {chosen.residual:.3g}, more than the tolerance {tolerance:g}; "
            "use more robust shapers, or a larger tolerance"
        )
    saved = 1.0 - chosen.duration / full.duration if full.duration > 0.0 else 0.0
    duration = f"{chosen.duration:.6g} s ({saved:.1%} shorter than all modes)"
    text = f"{heading}: {shown(chosen.modes)} shaped{kinds}, {duration}, rho = {chosen.residual:.4g}"
    if selection.mandatory:
        text += f"; without {shown(selection.mandatory)} the tolerance {tolerance:g} cannot be met"
    return text

"""The candidate shapers for a plant: every kind on every set of modes, and designs for all modes at once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

from shaper_fmu.design.impulse_sequence import ImpulseSequence, convolve_all
from shaper_fmu.design.shapers import shaper
from shaper_fmu.design.smoothers import smoother
from shaper_fmu.design.two_mode import direct_two_mode
from shaper_fmu.errors import ArgumentError, ComponentError
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.kinds.smoothed_modes import MODES as SMOOTHED_MODES
from shaper_fmu.kinds.smoothers import SMOOTHERS
from shaper_fmu.tune.choice.bands import ROOM, specified
from shaper_fmu.tune.choice.bounds import proven
from shaper_fmu.tune.choice.boxes import ModeBox, shares
from shaper_fmu.tune.choice.requirements import NEGATIVE, POSITIVE, SMOOTH, Requirements

MOST_MODES = 4
"""Modes that are shaped, those with the largest shares: as many as an InputShaper has."""
MOST_CUSTOM = 16
"""Impulses of a custom shaper in an InputShaper."""

_ATTEMPTS = 3
_SAME_PLACE = 1e-6
"""Middle and nominal point of a box that differ by less than this share are the same place to design for."""
_OFFLINE_WORDS = {"si": "SI", "direct_zv": "direct ZV", "direct_zvd": "direct ZVD"}


def label_of(kind: str) -> str:
    """The usual name of a kind of shaper or profile."""
    if kind in SHAPERS:
        return SHAPERS[kind].label
    if kind in SMOOTHERS:
        return SMOOTHERS[kind].label
    return _OFFLINE_WORDS.get(kind) or kind.replace("_", " ")


@dataclass(frozen=True)
class Factor:
    """A shaper for one or several modes.

    Attributes:
        kind: a name of `KNOWN`.
        modes: indices of the modes that it is designed for.
        sequence: its impulses.
        frequencies, dampings: what it is designed for, for each of these modes [rad/s, -].
        tolerance: of an EI shaper.
    """

    kind: str
    modes: tuple[int, ...]
    sequence: ImpulseSequence
    frequencies: tuple[float, ...]
    dampings: tuple[float, ...]
    tolerance: float = 0.0

    @property
    def name(self) -> str:
        """Its kind and the frequencies that it is for."""
        return f"{label_of(self.kind)} on {' and '.join(f'{w:.4g}' for w in self.frequencies)} rad/s"


@dataclass(frozen=True)
class Design:
    """Shapers one after the other; none of them: unshaped."""

    factors: tuple[Factor, ...]

    @cached_property
    def sequence(self) -> ImpulseSequence:
        """The impulses of all of them, convolved."""
        return convolve_all([factor.sequence for factor in self.factors])

    @cached_property
    def delay(self) -> float:
        """Delay of the last impulse [s]."""
        return sum(factor.sequence.duration for factor in self.factors)

    @property
    def name(self) -> str:
        """Its name in messages, such as "ZVD on 4.6 and 12 rad/s"."""
        if len({factor.kind for factor in self.factors}) == 1 and len(self.factors) > 1:
            frequencies = " and ".join(f"{f.frequencies[0]:.4g}" for f in self.factors)
            return f"{label_of(self.factors[0].kind)} on {frequencies} rad/s"
        return ", ".join(factor.name for factor in self.factors) or "unshaped"

    @property
    def by_kind(self) -> bool:
        """Whether an InputShaper (or a SmoothShaper) designs it itself: one kind, mode by mode, with one tolerance."""
        kinds = {(factor.kind, factor.tolerance) for factor in self.factors}
        return len(kinds) <= 1 and (self.smooth or all(factor.kind in SHAPERS for factor in self.factors))

    @property
    def smooth(self) -> bool:
        """Whether it is a smoother, which a SmoothShaper makes; `sequence` then has its V on the modes' ranges."""
        return len(self.factors) == 1 and self.factors[0].kind in SMOOTHERS

    def start_values(self) -> dict[str, Any]:
        """Start values of an InputShaper, or of a SmoothShaper if it is `smooth`, that make it this shaper.

        Raises ArgumentError for too many custom impulses.
        """
        if not self.factors:
            return {"shaper": "none"}
        if self.smooth:
            one = self.factors[0]
            return {
                "smoother": one.kind, "modes": len(one.modes),
                "natural_frequency": list(one.frequencies), "damping_ratio": list(one.dampings),
            }  # fmt: skip
        if self.by_kind:
            first = self.factors[0]
            return {
                "shaper": first.kind, "modes": len(self.factors), "vibration_tolerance": first.tolerance,
                "natural_frequency": [factor.frequencies[0] for factor in self.factors],
                "damping_ratio": [factor.dampings[0] for factor in self.factors],
            }  # fmt: skip
        count = len(self.sequence.delays)
        if count > MOST_CUSTOM:
            raise ArgumentError(f"{self.name} has {count} impulses; a custom InputShaper takes {MOST_CUSTOM}")
        return {
            "shaper": "custom", "custom_impulses": count,
            "custom_amplitude": list(self.sequence.amplitudes), "custom_delay": list(self.sequence.delays),
        }  # fmt: skip


@dataclass(frozen=True)
class LeftOut:
    """A design that could not be made, and the reason."""

    name: str
    reason: str


@dataclass
class Designs:
    """The designs to compare.

    Attributes:
        plain: designs, of which the first is the unshaped command.
        by_mode: factors for each mode, for combinations of different kinds and with modes left alone; one list for each `_Way`.
        left_out: what could not be designed, in this order, each once.
    """

    plain: list[Design] = field(default_factory=lambda: [Design(())])
    by_mode: list[list[list[Factor]]] = field(default_factory=list)
    left_out: dict[LeftOut, None] = field(default_factory=dict)

    def mixed(self) -> Iterator[Design]:
        """All combinations of a factor or none for each mode that are not plain."""
        known = {id_of(design) for design in self.plain}
        for by_mode in self.by_mode:
            for chosen in itertools.product(*([None, *factors] for factors in by_mode)):
                design = Design(tuple(factor for factor in chosen if factor is not None))
                if id_of(design) not in known:
                    known.add(id_of(design))
                    yield design

    def attempt(self, name: str, make: Callable[[], ImpulseSequence]) -> ImpulseSequence | None:
        """The result of `make`; None, with a reason in `left_out`, if there is no such design."""
        try:
            return make()
        except ComponentError as error:
            self.leave_out(name, str(error))
            return None

    def leave_out(self, name: str, reason: str) -> None:
        """Record a design that could not be made, once."""
        self.left_out[LeftOut(name, reason)] = None

    def add(self, factors: Sequence[Factor]) -> None:
        """Add a plain design that is new."""
        design = Design(tuple(factors))
        if id_of(design) not in {id_of(one) for one in self.plain}:
            self.plain.append(design)


def id_of(design: Design) -> tuple[tuple[Any, ...], ...]:
    """A key that distinguishes designs for the same modes."""
    return tuple((one.kind, one.modes, one.frequencies, one.dampings, one.tolerance) for one in design.factors)


@dataclass(frozen=True)
class _Way:
    """For what shapers are designed: a place in each box, and the largest tolerance of EI shapers."""

    places: tuple[tuple[float, float], ...]
    tolerance: float


def _ways(boxes: Sequence[ModeBox], requirements: Requirements) -> list[_Way]:
    """For the middles of the boxes; with a nominal condition also for the nominal points, and there EI shapers within it."""
    centres, nominal = tuple(box.centre for box in boxes), tuple(box.nominal for box in boxes)
    if all(
        abs(a - b) <= _SAME_PLACE * max(1.0, a)
        for one, other in zip(centres, nominal, strict=True)
        for a, b in zip(one, other, strict=True)
    ):
        nominal = centres
    wanted = requirements.tolerance * (1.0 - ROOM)
    ways = [_Way(centres, wanted)]
    if requirements.nominal_asked:
        ways += [_Way(nominal, min(one, wanted)) for one in (wanted, requirements.nominal_tolerance * (1.0 - ROOM))]
    return list(dict.fromkeys(ways))


def designs(boxes: Sequence[ModeBox], requirements: Requirements) -> Designs:
    """All designs for modes in these boxes."""
    found = Designs()
    parts = shares(boxes).max(axis=1)
    order = sorted((k for k in range(len(boxes)) if parts[k] > 0.0), key=lambda k: -parts[k])[:MOST_MODES]
    important = sorted(order)
    kinds = [kind for kind in (*POSITIVE, *NEGATIVE) if requirements.wants(kind)]
    ways = _ways(boxes, requirements)
    for way in ways:
        made = [_of_kind(found, kind, boxes, important, requirements.tolerance, way) for kind in kinds]
        for factors in made:
            if len(factors) == len(important):
                found.add(factors)
        found.by_mode.append([[f for factors in made for f in factors if f.modes == (k,)] for k in important])
    if requirements.wants("si"):
        for count in range(1, len(order) + 1):
            _specified(found, boxes, tuple(sorted(order[:count])), requirements)
    for kind in filter(requirements.wants, SMOOTH):
        for way in ways:
            for count in range(1, min(len(order), SMOOTHED_MODES) + 1):
                _smooth(found, kind, boxes, way.places, tuple(sorted(order[:count])))
    for kind in ("direct_zv", "direct_zvd"):
        if requirements.wants(kind) and len(order) > 1:
            for places in dict.fromkeys(way.places for way in ways):
                _direct(found, kind, places, tuple(sorted(order[:2])))
    return found


def _of_kind(found: Designs, kind: str, boxes: Sequence[ModeBox], modes: Sequence[int], wanted: float, way: _Way) -> list[Factor]:
    """This kind for each of the modes, with the same tolerance for all of them."""
    tolerance = wanted * (1.0 - ROOM)
    factors = []
    if SHAPERS[kind].tolerant:
        tolerance = min((_hump_tolerance(kind, boxes[k], way.places[k], way.tolerance, wanted) for k in modes), default=tolerance)
    for k in modes:
        w, zeta = way.places[k]
        name = f"{label_of(kind)} on {w:.4g} rad/s"
        sequence = found.attempt(name, lambda w=w, zeta=zeta: _designed(kind, w, zeta, tolerance))
        if sequence is not None:
            factors.append(Factor(kind, (k,), sequence, (w,), (zeta,), tolerance))
    return factors


@lru_cache(maxsize=256)
def _designed(kind: str, natural_frequency: float, damping_ratio: float, tolerance: float) -> ImpulseSequence:
    return shaper(kind, natural_frequency, damping_ratio, vibration_tolerance=tolerance)


def _hump_tolerance(kind: str, box: ModeBox, place: tuple[float, float], first: float, wanted: float) -> float:
    """Tolerance of an EI shaper that keeps V within `wanted` for the box's damping ratios, too; `first` if there is none."""
    try:
        return _tightened(lambda t: _designed(kind, *place, t), first, wanted, box)
    except ComponentError:  # reported where the shaper itself is designed
        return first


def _tightened(make: Callable[[float], ImpulseSequence], first: float, wanted: float, box: ModeBox) -> float:
    """A tolerance, `first` or less, whose design keeps V within `wanted` in the box; `first` if none is found."""
    tolerance = first
    for _ in range(_ATTEMPTS):
        worst = proven(make(tolerance), box).bound
        if worst <= wanted:
            return tolerance
        if worst > 2.0 * wanted:  # the range is too wide for it
            break
        tolerance *= (wanted / worst) ** 1.2 * (1.0 - ROOM)
    return first


def _specified(found: Designs, boxes: Sequence[ModeBox], modes: tuple[int, ...], requirements: Requirements) -> None:
    places = tuple(box.centre for box in boxes)
    name = f"SI on {' and '.join(f'{places[k][0]:.4g}' for k in modes)} rad/s"
    sequence = specified(boxes, modes, requirements, lambda make: found.attempt(name, make))
    if sequence is not None:
        _add(found, places, "si", modes, sequence)


def _smooth(
    found: Designs, kind: str, boxes: Sequence[ModeBox], places: Sequence[tuple[float, float]], modes: tuple[int, ...]
) -> None:
    """A smoother for these modes at once, as impulses of the same V on all modes' ranges."""
    frequencies, dampings = zip(*(places[k] for k in modes), strict=True)
    name = f"{label_of(kind)} on {' and '.join(f'{w:.4g}' for w in frequencies)} rad/s"
    highest = max(box.natural_frequency.high for box in boxes)
    sequence = found.attempt(name, lambda: smoother(kind, frequencies, dampings).as_impulses(highest))
    if sequence is not None:
        found.add((Factor(kind, modes, sequence, frequencies, dampings),))


def _direct(found: Designs, kind: str, places: Sequence[tuple[float, float]], modes: tuple[int, ...]) -> None:
    frequencies, dampings = zip(*(places[k] for k in modes), strict=True)
    name = f"{label_of(kind)} on {' and '.join(f'{w:.4g}' for w in frequencies)} rad/s"
    sequence = found.attempt(name, lambda: direct_two_mode(frequencies, dampings, kind.removeprefix("direct_")))
    if sequence is not None:
        _add(found, places, kind, modes, sequence)


def _add(
    found: Designs, places: Sequence[tuple[float, float]], kind: str, modes: tuple[int, ...], sequence: ImpulseSequence
) -> None:
    """Add a custom sequence, if an InputShaper has room for it."""
    frequencies, dampings = zip(*(places[k] for k in modes), strict=True)
    factor = Factor(kind, modes, sequence, frequencies, dampings)
    if len(sequence.delays) > MOST_CUSTOM:
        found.leave_out(factor.name, f"{len(sequence.delays)} impulses; an InputShaper takes {MOST_CUSTOM}")
    else:
        found.add((factor,))

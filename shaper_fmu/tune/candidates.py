"""The shapers that come into question for a plant: every kind on every set of modes, and designs for all modes at once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from shaper_fmu.analysis.guarantee import Guarantee, guarantee
from shaper_fmu.errors import ComponentError
from shaper_fmu.shapers.design import shaper
from shaper_fmu.shapers.lp_layout import Band
from shaper_fmu.shapers.sequence import ImpulseSequence, convolve_all
from shaper_fmu.shapers.specified_insensitivity import TOLERANCES, specified_insensitivity
from shaper_fmu.shapers.two_mode import direct_two_mode
from shaper_fmu.tune.boxes import ModeBox, shares
from shaper_fmu.tune.wish import NEGATIVE, POSITIVE, Wish

MOST_MODES = 4
"""Modes that are shaped, those with the largest shares: as many as an InputShaper has."""
MOST_CUSTOM = 16
"""Impulses of a custom shaper in an InputShaper."""

_PROOF_TOLERANCES = (1e-7, 1e-6, 1e-5, 1e-4)
"""How far a proven bound may be above the largest V: the first one that rounding allows."""
_ROOM = 1e-4
"""Share of the tolerance that is kept free of rounding."""
_HUMPS = ("ei", "two_hump_ei", "three_hump_ei", "um_ei")
_ATTEMPTS = 3
_NEAR = 0.97
"""Share of the tolerance that a design may leave unused."""
_WORDS = {"two_hump_ei": "two-hump EI", "three_hump_ei": "three-hump EI", "direct_zv": "direct ZV", "direct_zvd": "direct ZVD"}


def words(kind: str) -> str:
    """The usual name of a kind of shaper or profile."""
    return _WORDS.get(kind) or (kind.upper().replace("_", "-") if kind in (*POSITIVE, *NEGATIVE, "si") else kind.replace("_", " "))


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
        return f"{words(self.kind)} on {' and '.join(f'{w:.4g}' for w in self.frequencies)} rad/s"


@dataclass(frozen=True)
class Design:
    """Shapers one after the other; none of them: unshaped."""

    factors: tuple[Factor, ...]

    @cached_property
    def sequence(self) -> ImpulseSequence:
        """The impulses of all of them, convolved."""
        return convolve_all([factor.sequence for factor in self.factors])

    @property
    def delay(self) -> float:
        """Delay of the last impulse [s]."""
        return sum(factor.sequence.duration for factor in self.factors)

    @property
    def name(self) -> str:
        """In words, such as "ZVD on 4.6 and 12 rad/s"."""
        if len({factor.kind for factor in self.factors}) == 1 and len(self.factors) > 1:
            frequencies = " and ".join(f"{f.frequencies[0]:.4g}" for f in self.factors)
            return f"{words(self.factors[0].kind)} on {frequencies} rad/s"
        return ", ".join(factor.name for factor in self.factors) or "unshaped"

    @property
    def by_kind(self) -> bool:
        """Whether an InputShaper designs it itself: one kind, mode by mode, with one tolerance."""
        kinds = {(factor.kind, factor.tolerance) for factor in self.factors}
        return len(kinds) <= 1 and all(factor.kind in (*POSITIVE, *NEGATIVE) for factor in self.factors)

    def start_values(self) -> dict[str, Any]:
        """Start values of an InputShaper that make it this shaper. Raises ComponentError for too many custom impulses."""
        if not self.factors:
            return {"shaper": "none"}
        if self.by_kind:
            first = self.factors[0]
            return {
                "shaper": first.kind, "modes": len(self.factors), "vibration_tolerance": first.tolerance,
                "natural_frequency": [factor.frequencies[0] for factor in self.factors],
                "damping_ratio": [factor.dampings[0] for factor in self.factors],
            }  # fmt: skip
        count = len(self.sequence.delays)
        if count > MOST_CUSTOM:
            raise ComponentError(f"{self.name} has {count} impulses; a custom InputShaper takes {MOST_CUSTOM}")
        return {
            "shaper": "custom", "custom_impulses": count,
            "custom_amplitude": list(self.sequence.amplitudes), "custom_delay": list(self.sequence.delays),
        }  # fmt: skip


@dataclass(frozen=True)
class LeftOut:
    """What could not be designed, and why."""

    name: str
    reason: str


@dataclass
class Designs:
    """What comes into question: `plain` designs, and kinds that differ or modes left alone, as factors for each mode."""

    plain: list[Design] = field(default_factory=list)
    by_mode: list[list[Factor]] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)

    def mixed(self) -> Iterator[Design]:
        """All combinations of a factor or none for each mode that are not plain."""
        known = {id_of(design) for design in self.plain}
        for chosen in itertools.product(*([None, *factors] for factors in self.by_mode)):
            design = Design(tuple(factor for factor in chosen if factor is not None))
            if id_of(design) not in known:
                yield design

    def attempt(self, name: str, make: Callable[[], ImpulseSequence]) -> ImpulseSequence | None:
        """What `make` gives; None, and a reason in `left_out`, where there is no such design."""
        try:
            return make()
        except ComponentError as error:
            self.left_out.append(LeftOut(name, str(error)))
            return None


def id_of(design: Design) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """What tells designs for the same modes apart."""
    return tuple((factor.kind, factor.modes) for factor in design.factors)


def designs(boxes: Sequence[ModeBox], wish: Wish) -> Designs:
    """All designs for modes in these boxes; `plain` begins with the unshaped command."""
    found = Designs([Design(())])
    parts = shares(boxes).max(axis=1)
    important = sorted(sorted(range(len(boxes)), key=lambda k: -parts[k])[:MOST_MODES])
    important = [k for k in important if parts[k] > 0.0]
    kinds = [kind for kind in (*POSITIVE, *NEGATIVE) if wish.wants(kind)]
    made = {kind: _of_kind(found, kind, boxes, important, wish.tolerance) for kind in kinds}
    found.plain += [Design(tuple(factors)) for factors in made.values() if len(factors) == len(important)]
    found.by_mode = [[f for factors in made.values() for f in factors if f.modes == (k,)] for k in important]
    order = sorted(important, key=lambda k: -parts[k])
    if wish.wants("si"):
        for count in range(1, len(order) + 1):
            _specified(found, boxes, tuple(sorted(order[:count])), wish.tolerance)
    for kind in ("direct_zv", "direct_zvd"):
        if wish.wants(kind) and len(order) > 1:
            _direct(found, kind, boxes, tuple(sorted(order[:2])))
    return found


def _of_kind(found: Designs, kind: str, boxes: Sequence[ModeBox], modes: Sequence[int], wanted: float) -> list[Factor]:
    """This kind for each of the modes, with the same tolerance for all of them."""
    tolerance = wanted * (1.0 - _ROOM)
    factors = []
    if kind in _HUMPS:
        tolerance = min((_hump_tolerance(kind, boxes[k], wanted) for k in modes), default=tolerance)
    for k in modes:
        w, zeta = boxes[k].centre
        name = f"{words(kind)} on {w:.4g} rad/s"
        sequence = found.attempt(name, lambda w=w, zeta=zeta: _designed(kind, w, zeta, tolerance))
        if sequence is not None:
            factors.append(Factor(kind, (k,), sequence, (w,), (zeta,), tolerance))
    return factors


@lru_cache(maxsize=256)
def _designed(kind: str, natural_frequency: float, damping_ratio: float, tolerance: float) -> ImpulseSequence:
    return shaper(kind, natural_frequency, damping_ratio, vibration_tolerance=tolerance)


def _hump_tolerance(kind: str, box: ModeBox, wanted: float) -> float:
    """Tolerance of an EI shaper that keeps V within `wanted` for the box's damping ratios, too; `wanted` if there is none."""
    first = wanted * (1.0 - _ROOM)
    try:
        return _tightened(lambda t: _designed(kind, *box.centre, t), first, wanted, box)
    except ComponentError:  # it is told where the shaper itself is designed
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
        tolerance *= (wanted / worst) ** 1.2 * (1.0 - _ROOM)
    return first


def _specified(found: Designs, boxes: Sequence[ModeBox], modes: tuple[int, ...], tolerance: float) -> None:
    """Specified insensitivity for these modes, as loose as the worst case of all modes allows; the others are left alone.

    Of a few designs the shortest one that fits: a design knows one damping ratio only, and not what it leaves of other modes.
    """
    parts = shares(boxes)
    shaped = parts[list(modes)].sum(axis=0)
    used = shaped > 0.0
    allowed = float(((tolerance - (1.0 - shaped[used])) / shaped[used]).min(initial=1.0)) * (1.0 - _ROOM)
    if (1.0 - shaped).max(initial=0.0) > tolerance or allowed < TOLERANCES[0]:
        return
    name = f"SI on {' and '.join(f'{boxes[k].centre[0]:.4g}' for k in modes)} rad/s"
    best: tuple[bool, float, ImpulseSequence] | None = None
    for number in range(_ATTEMPTS):
        allowed = min(max(allowed, TOLERANCES[0]), TOLERANCES[1])
        sequence = found.attempt(name, lambda wanted=allowed: _for_bands(boxes, modes, wanted))
        if sequence is None:
            break
        worst = float((parts.T @ [proven(sequence, box).bound for box in boxes]).max())
        rank = (worst > tolerance, sequence.duration, sequence)
        best = rank if best is None or rank[:2] < best[:2] else best
        if worst <= tolerance and (number > 0 or worst >= _NEAR * tolerance):
            break
        allowed *= tolerance / worst * (1.0 - _ROOM)
    if best is not None:
        _add(found, boxes, "si", modes, best[2])


def _for_bands(boxes: Sequence[ModeBox], modes: Sequence[int], tolerance: float) -> ImpulseSequence:
    bands = [Band(*boxes[k].frequencies, tolerance, boxes[k].centre[1]) for k in modes]
    first = bands[0]
    return specified_insensitivity(first.low, first.high, tolerance, first.damping_ratio, bands[1:])


def _direct(found: Designs, kind: str, boxes: Sequence[ModeBox], modes: tuple[int, ...]) -> None:
    frequencies, dampings = zip(*(boxes[k].centre for k in modes), strict=True)
    name = f"{words(kind)} on {' and '.join(f'{w:.4g}' for w in frequencies)} rad/s"
    sequence = found.attempt(name, lambda: direct_two_mode(frequencies, dampings, kind.removeprefix("direct_")))
    if sequence is not None:
        _add(found, boxes, kind, modes, sequence)


def _add(found: Designs, boxes: Sequence[ModeBox], kind: str, modes: tuple[int, ...], sequence: ImpulseSequence) -> None:
    """Add a custom sequence, if an InputShaper has room for it."""
    frequencies, dampings = zip(*(boxes[k].centre for k in modes), strict=True)
    factor = Factor(kind, modes, sequence, frequencies, dampings)
    if len(sequence.delays) > MOST_CUSTOM:
        found.left_out.append(LeftOut(factor.name, f"{len(sequence.delays)} impulses; an InputShaper takes {MOST_CUSTOM}"))
    else:
        found.plain.append(Design((factor,)))


def proven(sequence: ImpulseSequence, box: ModeBox) -> Guarantee:
    """A bound of V over a box. Raises ComponentError for a command so long that its phase is lost in rounding."""
    for tolerance in _PROOF_TOLERANCES[:-1]:
        try:
            return guarantee(sequence, box.frequencies, box.dampings, tolerance=tolerance)
        except ComponentError:  # finer than rounding allows, or too many cells
            continue
    return guarantee(sequence, box.frequencies, box.dampings, tolerance=_PROOF_TOLERANCES[-1])


def remaining(sequence: ImpulseSequence, box: ModeBox) -> np.ndarray:
    """F = sum A_i exp(p (T - t_i)) at some points of the box's boundary, complex, shape (36,); V = |F|."""
    w = np.concatenate([np.linspace(*box.frequencies, 9), np.linspace(*box.frequencies, 9), np.repeat(box.frequencies, 9)])
    light, heavy = box.dampings
    zeta = np.concatenate([np.full(9, light), np.full(9, heavy), np.tile(np.linspace(light, heavy, 9), 2)])
    poles = w * (-zeta + 1j * np.sqrt(1.0 - zeta * zeta))
    return np.exp(np.multiply.outer(poles, sequence.duration - np.array(sequence.delays))) @ np.array(sequence.amplitudes)

"""The ranges that a shaper has to cover: each mode's box of frequency and damping, and its share of the response."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.errors import ArgumentError
from shaper_fmu.tune.identify.range import ModeRange, PlantModes, Range

_MOST_DAMPED = 0.95
"""Damping ratio above which nothing swings; ranges of uncertain modes end here."""


SAME_MODE = math.log(1.25)
"""Modes of two sets whose frequencies differ by less are the same one, the nearest ones first."""
UNDAMPED = 1e-6
"""Damping ratio up to which a mode counts as undamped in designs and in messages; bounds use the true one."""


@dataclass(frozen=True)
class ModeBox:
    """A mode: a box of natural frequencies and damping ratios, and how much it swings.

    Attributes:
        natural_frequency: [rad/s], 0 < low <= nominal <= high.
        damping_ratio: 0 <= low <= nominal <= high < 1.
        amplitudes: of the mode in the response to an unshaped step, one for each output (or for each output at each
            operating point), in any unit that all modes share; only their ratios between modes count.
    """

    natural_frequency: Range
    damping_ratio: Range
    amplitudes: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitudes", tuple(float(a) for a in self.amplitudes))
        w, zeta = self.natural_frequency, self.damping_ratio
        if not 0.0 < w.low <= w.nominal <= w.high < math.inf:
            raise ArgumentError(f"natural frequency {w.low:g}, {w.nominal:g}, {w.high:g} rad/s: 0 < low <= nominal <= high")
        if not 0.0 <= zeta.low <= zeta.nominal <= zeta.high < 1.0:
            raise ArgumentError(f"damping ratio {zeta.low:g}, {zeta.nominal:g}, {zeta.high:g}: 0 <= low <= nominal <= high < 1")
        if not self.amplitudes or not all(0.0 <= a < math.inf for a in self.amplitudes):
            raise ArgumentError(f"amplitudes {self.amplitudes}: give at least one; they are finite and not negative")

    @property
    def frequencies(self) -> tuple[float, float]:
        """Lowest and highest natural frequency [rad/s]."""
        return self.natural_frequency.low, self.natural_frequency.high

    @property
    def dampings(self) -> tuple[float, float]:
        """Least and largest damping ratio."""
        return self.damping_ratio.low, self.damping_ratio.high

    @property
    def centre(self) -> tuple[float, float]:
        """Natural frequency [rad/s] and damping ratio that shapers are designed for: the middle of the box.

        Damping that is nothing but rounding is 0, for which designs are symmetric and quick.
        """
        zeta = 0.5 * sum(self.dampings)
        return 0.5 * sum(self.frequencies), zeta if zeta > UNDAMPED else 0.0

    @property
    def nominal(self) -> tuple[float, float]:
        """Nominal natural frequency [rad/s] and damping ratio, as shapers are designed for: see `centre`."""
        zeta = self.damping_ratio.nominal
        return self.natural_frequency.nominal, zeta if zeta > UNDAMPED else 0.0

    @property
    def at_nominal(self) -> ModeBox:
        """The box of no width at the nominal point."""
        return self.scaled(0.0, nominally=True)

    def widened(self, frequency_margin: float, damping_margin: float = 0.0) -> ModeBox:
        """The box from low (1 - margin) to high (1 + margin), of frequency and of damping ratio."""
        if not (0.0 <= frequency_margin < 1.0 and 0.0 <= damping_margin < math.inf):
            raise ArgumentError(f"margins {frequency_margin:g}, {damping_margin:g}: the frequency's is 0 to 1, both are positive")
        w, zeta = self.natural_frequency, self.damping_ratio
        most = max(zeta.high, min(_MOST_DAMPED, zeta.high * (1.0 + damping_margin)))
        return replace(
            self,
            natural_frequency=Range(w.low * (1.0 - frequency_margin), w.nominal, w.high * (1.0 + frequency_margin)),
            damping_ratio=Range(max(0.0, zeta.low * (1.0 - damping_margin)), zeta.nominal, most),
        )

    def scaled(self, factor: float, *, nominally: bool = False) -> ModeBox:
        """The box with `factor` times the widths about its middle, or `nominally` about its nominal point; that is nominal then."""
        ends = self.frequencies, self.dampings
        about = (self.natural_frequency.nominal, self.damping_ratio.nominal) if nominally else (0.5 * sum(e) for e in ends)
        w, zeta = (
            Range(middle - (middle - low) * factor, middle, middle + (high - middle) * factor)
            for middle, (low, high) in zip(about, ends, strict=True)
        )
        return replace(self, natural_frequency=w, damping_ratio=Range(max(0.0, zeta.low), zeta.nominal, zeta.high))

    def damped_at_most(self, limit: float) -> ModeBox:
        """The part of the box up to a damping ratio, which is the least one or larger."""
        zeta = self.damping_ratio
        return replace(self, damping_ratio=Range(zeta.low, min(zeta.nominal, limit), min(zeta.high, limit)))

    @classmethod
    def around(
        cls, natural_frequency: float, damping_ratio: float = 0.0, margin: float = 0.0, amplitudes: Sequence[float] = (1.0,)
    ) -> ModeBox:
        """A mode whose natural frequency [rad/s] is known but for +-`margin`, as a share of it."""
        w, zeta = Range(*(natural_frequency,) * 3), Range(*(damping_ratio,) * 3)
        return cls(w, zeta, tuple(amplitudes)).widened(margin)

    @classmethod
    def of_range(cls, found: ModeRange, amplitudes: Sequence[float] = (1.0,), deviations: float = 2.0) -> ModeBox:
        """A mode's range over all experiments, wider by so many standard deviations of each."""
        modes = [mode for mode in found.modes if mode is not None]
        frequencies = [(m.natural_frequency, deviations * m.natural_frequency_std) for m in modes]
        dampings = [(m.damping_ratio, deviations * m.damping_ratio_std) for m in modes]
        w, zeta = found.natural_frequency, found.damping_ratio
        # half of the frequency remains at least: wider is no knowledge of a mode
        low = min(w.low, *(max(0.5 * v, v - s) for v, s in frequencies))
        high = max(w.high, *(min(2.0 * v, v + s) for v, s in frequencies))
        light = max(0.0, min(zeta.low, *(v - s for v, s in dampings)))
        heavy = max(zeta.high, *(min(_MOST_DAMPED, v + s) for v, s in dampings))
        return cls(Range(low, w.nominal, high), Range(light, zeta.nominal, heavy), tuple(amplitudes))


def mode_boxes(plant: PlantModes, outputs: Sequence[str] | None = None, deviations: float = 2.0) -> list[ModeBox]:
    """A box for each mode that experiments have shown, with its amplitudes in the response to a unit step of the input.

    There is an amplitude for each of the `outputs` (all of them without a choice) at each operating point. Where a mode was not
    found at a point, its amplitude there is that of the nominal point.
    """
    names = list(outputs or plant.nominal.outputs)
    boxes = []
    for found in plant.ranges:
        amplitudes: list[float] = []
        for here, mode in zip(plant.experiments, found.modes, strict=True):
            shown, seen = (here, mode) if mode is not None else (plant.nominal, found.modes[0])
            assert seen is not None  # ranges are those of the nominal experiment's modes
            sizes = np.abs(shown.step_residues(seen))
            amplitudes += [float(sizes[shown.outputs.index(name)]) for name in names]
        boxes.append(ModeBox.of_range(found, amplitudes, deviations))
    return boxes


def shares(boxes: Sequence[ModeBox]) -> np.ndarray:
    """Each mode's share of the sum of all modes' amplitudes, for each case in which anything swings; shape (modes, cases)."""
    if len({len(box.amplitudes) for box in boxes}) != 1:
        raise ArgumentError(f"the modes have {', '.join(str(len(b.amplitudes)) for b in boxes)} amplitudes; each needs as many")
    amplitudes = np.array([box.amplitudes for box in boxes])
    total = amplitudes.sum(axis=0)
    if not (total > 0.0).any():
        raise ArgumentError("no mode has an amplitude above 0: nothing vibrates, so that no shaper is needed")
    return amplitudes[:, total > 0.0] / total[total > 0.0]


def merged_boxes(sets: Sequence[Sequence[ModeBox]]) -> list[ModeBox]:
    """The boxes of several inputs or recordings of one plant: those within 25 % are the same mode, the nearest ones first.

    A merged box contains both. Its amplitudes are those of all sets, one after the other, 0 where a set does not have the mode.
    """
    sizes = [len(boxes[0].amplitudes) if boxes else 0 for boxes in sets]
    found: list[tuple[ModeBox, list[float]]] = []
    for number, boxes in enumerate(sets):
        before = sum(sizes[:number])
        near = sorted(
            (abs(math.log(one.natural_frequency.nominal / box.natural_frequency.nominal)), i, j)
            for i, (one, _) in enumerate(found)
            for j, box in enumerate(boxes)
        )
        taken: dict[int, int] = {}
        for distance, i, j in near:
            if distance < SAME_MODE and i not in taken.values() and j not in taken:
                taken[j] = i
        for i, (_, amplitudes) in enumerate(found):
            amplitudes += [0.0] * sizes[number] if i not in taken.values() else []
        for j, box in enumerate(boxes):
            if j in taken:
                one, amplitudes = found[taken[j]]
                found[taken[j]] = _around_both(one, box), [*amplitudes, *box.amplitudes]
            else:
                found.append((box, [*([0.0] * before), *box.amplitudes]))
    return [replace(box, amplitudes=tuple(amplitudes)) for box, amplitudes in found]


def _around_both(one: ModeBox, other: ModeBox) -> ModeBox:
    w, zeta = (
        Range(min(a.low, b.low), a.nominal, max(a.high, b.high))
        for a, b in ((one.natural_frequency, other.natural_frequency), (one.damping_ratio, other.damping_ratio))
    )
    return replace(one, natural_frequency=w, damping_ratio=zeta)

"""Separates the vibration after a command from a slow part, from noise, and from a motion that is there without a command."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shaper_fmu.analysis.identification import noise_of
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.commanded import CommandedRuns
from shaper_fmu.tune.verification.shares import QUIET, Measured
from shaper_fmu.tune.verification.swing import SlowPart, Swing, swing_of

AT_REST = 0.1
"""Share of the tolerance that motion without a command may have of the unshaped residual."""
_LESS = 0.47
"""Of the command, to find out whether the plant is linear."""
_LOOKS = 1500
"""Samples from which a level of noise is measured."""
_CHANCE = 3.0
"""Standard deviations of a variance by which the noise of a record may exceed its level."""


@dataclass
class Separation:
    """What is no vibration in the outputs of a plant.

    Attributes:
        runs: of the plant.
        slow: poles of the modes and of the slow part; None to take all motion for vibration.
        tolerance: of the shares.
        noise: standard deviation of each output's noise, 0 without; shape (outputs,).
        subtracted: whether the motion without a command is taken away from the others.
        later: half the peak-to-peak value of the unshaped vibration in the later part of the last record, shape (outputs,).
    """

    runs: CommandedRuns
    slow: SlowPart | None
    tolerance: float
    noise: np.ndarray = field(init=False)
    subtracted: bool = False
    later: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.noise = np.zeros(len(self.runs.outputs))
        self.later = np.zeros(len(self.runs.outputs))

    @property
    def needed(self) -> bool:
        """Whether there is anything to be separated."""
        return self.slow is not None and (self.slow.moves or self.subtracted or bool(self.noise.any()))

    def look(self, found: Measured, least: float) -> None:
        """Find out what moves without a command: noise, or a motion that can be taken away since the plant is linear.

        `found` are the residuals at the nominal parameters, as they are. Noise is one above `least` of the unshaped residual, from
        which on it would be seen in the shares.
        """
        rest, before = np.array(found.rest), np.array(found.before)
        quiet = QUIET * max(before)
        if self.slow is None or not (rest > np.maximum(quiet, least * before)).any():
            return
        begin, record = self.runs.record("rest", {}, max(self._long, _LOOKS * self.runs.step))
        self.noise = np.where(rest > quiet, noise_of(record[begin:]), 0.0)
        moving = (rest > np.maximum(quiet, AT_REST * self.tolerance * before)) & (self.noise == 0.0)
        self.subtracted = bool(moving.any()) and self._superposes()

    def _superposes(self) -> bool:
        """Whether 0.47 of the command makes 0.47 of the difference to the motion without it."""
        runs = self.runs
        if not isinstance(runs.command, Command):
            return False
        less = replace(runs.command, amplitude=_LESS * runs.command.amplitude).cases(runs.plant, runs.candidate)
        runs.cases["less"] = less["before"]
        begin, rest = runs.record("rest", {}, self._long)
        whole, part = (runs.record(case, {}, self._long)[1] - rest for case in ("before", "less"))
        apart = np.ptp((part / _LESS - whole)[begin:], axis=0)
        return bool((apart <= AT_REST * self.tolerance * np.ptp(whole[begin:], axis=0)).all())

    @property
    def _long(self) -> float:
        """Duration of a record in which the vibration is separated [s]."""
        return self.runs.window * (4.0 if self.noise.any() else 2.0)

    def measured(self, values: Mapping[str, float]) -> Measured:
        """The residuals of the vibration alone at these parameters."""
        assert self.slow is not None
        runs = self.runs
        found: dict[str, Swing] = {}
        for case in ("before", "after"):
            begin, record = runs.record(case, values, self._long)
            if self.subtracted:
                rest = runs.record("rest", values, self._long + runs.cases[case].end - runs.cases["rest"].end)[1]
                record = record - rest[: len(record)]
            known = found["before"].poles if found else None
            scale = runs.cases[case].scale
            noise = scale * self.noise * (math.sqrt(2.0) if self.subtracted else 1.0)
            found[case] = swing_of(scale * record[begin:], runs.step, self.slow, runs.window, noise, known)
        before, after = found["before"], found["after"]
        sizes = before.half
        seen = sizes > QUIET * max(sizes)
        doubt = float(np.max((after.doubt[seen] + before.doubt[seen] * after.half[seen] / sizes[seen]) / sizes[seen], initial=0.0))
        self.later = before.later
        measured = Measured(values, tuple(sizes.tolist()), tuple(after.half.tolist()), 0.0, self._moving(values), doubt)
        return replace(measured, share=max(measured.shares))

    def _moving(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Residuals without a command but for noise; 0 where they are taken away."""
        if self.subtracted:
            return (0.0,) * len(self.runs.outputs)
        record = self._at_rest(values)
        half = 0.5 * self.runs.cases["rest"].scale * np.ptp(record, axis=0)
        return tuple(np.where((noise_of(record) > 0.0) | self._is_at_level(record), 0.0, half).tolist())

    def _is_at_level(self, record: np.ndarray) -> np.ndarray:
        """Whether a record without a command is no more than the known noise: few samples of it may seem to be no white ones."""
        allowed = 1.0 + _CHANCE * math.sqrt(2.0 / len(record))
        return (self.noise > 0.0) & (np.var(record, axis=0) <= allowed * self.noise**2)

    def _at_rest(self, values: Mapping[str, float]) -> np.ndarray:
        begin, record = self.runs.record("rest", values, self._long)
        return record[begin:]

    def stays_white(self) -> bool:
        """Whether samples at the runs' step are independent looks at the noise: those of one that is held for longer are not."""
        seen = noise_of(self._at_rest({}))
        return bool((seen[self.noise > 0.0] > 0.0).all())

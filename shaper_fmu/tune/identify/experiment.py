"""Identifies a plant by experiments on its FMU: a survey, then refined experiments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.analysis.identification import (
    Finding,
    Identification,
    IdentificationError,
    Mode,
    OtherPole,
    free_response,
    identify,
)
from shaper_fmu.design.modal_responses import ModalResponse, modal_response
from shaper_fmu.errors import ArgumentError, ShaperFmuError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.slips import checked_number
from shaper_fmu.tune.identify.excitation import Excitation, ExcitationKind
from shaper_fmu.tune.identify.linear_comparison import LinearComparison, compare
from shaper_fmu.tune.identify.linear_modes import AT_REST
from shaper_fmu.tune.identify.linearization import NoLinearizationError, linearize
from shaper_fmu.tune.identify.response import LINEAR, TOLERATED, Experiment, Response
from shaper_fmu.tune.identify.survey import survey
from shaper_fmu.tune.plant import Plant

_LONGER = 1.3
_FEW_PER_PERIOD = 16
_FEW_PERIODS = 6.0
_FEW_SAMPLES = 96
"""What is enough where a response is the same at two steps to this share of a pole:"""
_SAME_POLE = 1e-5
_FEWEST_PERIODS = 4.5
_SAMPLES_PER_PERIOD = 30
_FEWEST_PER_PERIOD = 12
_TIME_CONSTANTS = 3.0
_PERIODS = (6.0, 60.0)
_MOST_SAMPLES = 5000
_FEWEST_SAMPLES = 400
_REFINEMENTS = 4
_CLOSER = 0.2
"""Step over the one before, where that was too coarse."""
_SETTLED_ENOUGH = 1.3
_GROWTH = 7.0
"""Time constants of what grows, at most: a factor of 1100."""


@dataclass(frozen=True, repr=False)
class PlantIdentification:
    """The result of an experiment at one operating point.

    Attributes:
        identification: modes and other poles of the free response; time 0 is its first sample.
        excitation: what was done to the input, at which amplitude.
        time: of the free response's samples, from the first on [s], shape (n,).
        response: outputs less those without excitation, shape (n, m).
        input, input_unit, outputs, units: names and units; `response` has a column for each output.
        settle_time: until the plant rests, and the excitation begins [s].
        nonlinearity: what of the response does not scale when the amplitude is halved, as a share of it.
        coupling: what the length of the communication step changes of the response, as a share of it; 0 for an FMU alone.
        start_values: of the operating point.
        findings: what the user should know, of the experiment and of the identification.
        linear: comparison with the FMU's linearization; None where that cannot be had.
        grid: internal step of an FMU that moves only in these [s], else 0.
    """

    identification: Identification
    excitation: Excitation
    time: np.ndarray
    response: np.ndarray
    input: str
    input_unit: str
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    settle_time: float
    nonlinearity: float
    coupling: float
    start_values: Mapping[str, Any]
    findings: tuple[Finding, ...]
    linear: LinearComparison | None = None
    grid: float = 0.0

    def __repr__(self) -> str:
        modes = ", ".join(f"{one.natural_frequency:.4g} rad/s (damping ratio {one.damping_ratio:.3g})" for one in self.modes)
        return f"<PlantIdentification: {self.input} -> {', '.join(self.outputs)}; {modes or 'no modes'}>"

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Modes of vibration, by rising natural frequency."""
        return self.identification.modes

    @property
    def step(self) -> float:
        """Distance of the samples [s]."""
        return self.identification.step

    def has(self, code: str) -> bool:
        """Whether there is a finding of this code."""
        return any(finding.code == code for finding in self.findings)

    def step_residues(self, part: Mode | OtherPole) -> np.ndarray:
        """Residues of a pole in the response to a unit step of the input, from its beginning, complex, shape (m,).

        The vibrating part of x_j(t) is Re(residue exp(pole t)), in the output's unit per unit of the input.
        """
        moment = self.excitation.end + self.step
        return part.residues[0] / self.excitation.transform(part.pole, moment)

    def step_response(self, outputs: Sequence[str] | None = None) -> ModalResponse:
        """The response to a unit step of the input, for outputs that settle. Raises IdentificationError if they do not."""
        names = list(outputs or self.outputs)
        places = [self.outputs.index(name) for name in names]
        for other in self.identification.others:
            moves = np.abs(other.residues[0][places]).max(initial=0.0) > 0.0
            if moves and other.kind in ("offset", "drift", "acceleration", "unstable", "growth"):
                raise IdentificationError(f"the response to a step does not settle at a final value: there is {other.kind} in it")
        parts = [*self.modes, *(o for o in self.identification.others if o.pole.real < 0.0 and o.kind != "harmonic")]
        residues = np.array([self.step_residues(part)[places] for part in parts]).T
        final = -np.real(residues).sum(axis=1)
        return modal_response([part.pole for part in parts], residues, final, names)


def experiment(
    source: Plant | System | Fmu | Path | str,
    input: str = "",
    outputs: Sequence[str] | None = None,
    *,
    point: Mapping[str, Any] | None = None,
    start_values: Mapping[str, Any] | None = None,
    excitation: ExcitationKind = "pulse",
    amplitude: float | None = None,
    duration: float | None = None,
    smallest_share: float = 1e-3,
    linear: bool = True,
    restored: bool = True,
    like: PlantIdentification | None = None,
    settle: float = 0.0,
) -> PlantIdentification:
    """Identify the modes from `input` to `outputs` at an operating point, by experiments.

    Args:
        source: an FMU's path, an `Fmu`, a `System` with a free input, or a `Plant` made of them.
        input, outputs, start_values: see `Plant`.
        point: start values of the operating point, by name; the input's is the value that it is excited about.
        excitation: what is done to the input.
        amplitude: of the excitation, in the input's unit; None to find one at which the response is linear.
        duration: a guess of how long a few periods of the slowest mode take [s]; else the FMU's default experiment, or 10 s.
        smallest_share: modes with less of the amplitude than this, in each output, are not listed.
        linear: whether the modes are compared with those of the FMU's linearization, where it can be had (see `linearize`).
        restored: whether runs begin in the settled states, where the FMUs save and restore them exactly; else all at the start.
        like: an experiment on the same plant at another point, whose samples may do here, too: no survey is made if they show as
            many modes as there.
        settle: time that the plant needs before the experiment [s]; longer where it does not rest by then.

    Raises IdentificationError if the data support no answer, SimulationError if the plant cannot be run, ModelError for names.
    """
    plant = Plant.of(source, input, outputs, start_values)
    checked_number("settle", settle)
    if not 0.0 <= settle < math.inf:
        raise ArgumentError(f"settle = {settle:g} s: a time of at least 0 is needed, after which the plant rests")
    trial = Experiment(plant, dict(point or {}), settle_time=settle, restored=restored)
    try:
        guess = duration or (_LONGER * like.step * len(like.time) if like is not None and like.modes else plant.duration_hint)
        first = amplitude if amplitude is not None else plant.first_amplitude(trial.rest)
        with plant.meter.part("settle"):
            if like is None:
                trial.find_grid(first)
            else:
                trial.grid = like.grid
            unrest = trial.settle(guess)
        search = _Search(excitation, first, smallest_share, search=amplitude is None)
        found, response = _alike(trial, search, like) or _identified(trial, search, guess)
    finally:
        trial.close()
    findings = _findings(response, trial, unrest) + list(found.findings)
    with plant.meter.part("linearize"):
        compared, differences = _compared(trial, found, response, smallest_share) if linear else (None, [])
    return PlantIdentification(
        found, response.excitation, response.time, response.values, plant.input, plant.input_unit, tuple(plant.outputs),
        tuple(plant.units), trial.settle_time, response.nonlinearity, response.coupling, dict(point or {}),
        tuple(findings + differences), compared, trial.grid,
    )  # fmt: skip


@dataclass(frozen=True)
class _Search:
    """How modes are looked for: see `experiment`; with `search` at ever smaller amplitudes, until the response is linear."""

    kind: ExcitationKind
    amplitude: float
    smallest_share: float
    search: bool

    def from_amplitude(self, seen: Response) -> _Search:
        """The same from the amplitude on at which a response was seen to be linear."""
        return replace(self, amplitude=seen.excitation.amplitude) if self.search else self


def _identified(trial: Experiment, search: _Search, guess: float) -> tuple[Identification, Response]:
    """A first look, then a closer one; more of these, with more samples, until the modes stay."""
    with trial.plant.meter.part("look"):
        seen = survey(trial, search.kind, search.amplitude, guess)
    with trial.plant.meter.part("excite"):
        found, response = seen.found, seen.response
        if found.modes and not found.has("too_fast"):
            search = search.from_amplitude(response)
            before, (found, response) = found, _closer(trial, search, _few(found, trial))
            if _agree(before, found):
                return found, response
        for _ in range(_REFINEMENTS):
            before, (found, response) = found, _closer(trial, search, _sampling(found, seen.duration, trial))
            if not found.has("too_fast") and (_is_same(before, found, trial) or not found.vibrates):
                break
        return found, response


def _alike(trial: Experiment, search: _Search, like: PlantIdentification | None) -> tuple[Identification, Response] | None:
    """An experiment with the samples of one at another point; None if they do not show as many modes, or do not resolve them."""
    if like is None or not like.modes or like.excitation.kind != search.kind:
        return None
    with trial.plant.meter.part("excite"):
        try:
            search = replace(search, amplitude=like.excitation.amplitude) if search.search else search
            found, response = _closer(trial, search, _Sampling(like.step, like.excitation.width, len(like.time)))
        except IdentificationError:
            return None
    periods = [mode.period for mode in found.modes]
    resolved = len(periods) == len(like.modes) and not any(found.has(code) for code in ("too_fast", "too_slow", "not_converged"))
    resolved = resolved and response.nonlinearity <= max(LINEAR, like.nonlinearity)
    resolved = resolved and min(periods) >= _FEWEST_PER_PERIOD * like.step
    if not resolved or max(periods) * _FEWEST_PERIODS > like.step * len(like.time):
        return None
    return found, response


def _agree(one: Identification, other: Identification) -> bool:
    """Whether two records show the same modes, to `_SAME_POLE`."""
    if len(one.modes) != len(other.modes) or other.has("too_fast"):
        return False
    pairs = zip(one.modes, other.modes, strict=True)
    return all(abs(a.pole - b.pole) <= _SAME_POLE * abs(b.pole) for a, b in pairs)


def _few(found: Identification, trial: Experiment) -> _Sampling:
    """So many samples as show the modes of a response without noise."""
    fastest, slowest = (limit(mode.period for mode in found.modes) for limit in (min, max))
    step = trial.on_grid(fastest / _FEW_PER_PERIOD)
    samples = max(_FEW_SAMPLES, math.ceil(_FEW_PERIODS * slowest / step))
    if samples > _MOST_SAMPLES:
        return _sampling(found, 1.0, trial)
    return _Sampling(step, step * max(1, round(0.25 * fastest / step)), samples)


@dataclass(frozen=True)
class _Sampling:
    """Step and pulse width [s], and number of samples."""

    step: float
    width: float
    samples: int


def _sampling(found: Identification, looked: float, trial: Experiment) -> _Sampling:
    """Samples for the fastest mode, a duration for the slowest decay; the survey's if nothing vibrates."""
    if not found.modes:
        step = trial.on_grid(looked / 2000.0)
        return _Sampling(step, 8.0 * step, 2000)
    fastest = min(mode.period for mode in found.modes)
    if found.has("too_fast"):
        fastest = min(fastest, _CLOSER * _SAMPLES_PER_PERIOD * found.step)
    slowest = max(mode.period for mode in found.modes)
    decay = min(mode.damping_ratio * mode.natural_frequency for mode in found.modes)
    lasting = _TIME_CONSTANTS / decay if decay > 0.0 else math.inf
    duration = min(max(_PERIODS[0] * slowest, lasting), _PERIODS[1] * slowest)
    rising = max((other.pole.real for other in found.others if other.kind in ("growth", "unstable")), default=0.0)
    if rising > 0.0:
        duration = min(duration, _GROWTH / rising)
    step = fastest / _SAMPLES_PER_PERIOD
    if duration / step > _MOST_SAMPLES:
        step = min(fastest / _FEWEST_PER_PERIOD, duration / _MOST_SAMPLES)
        duration = max(min(duration, _MOST_SAMPLES * step), 3.0 * slowest)
    step = trial.on_grid(step)
    return _Sampling(step, step * max(1, round(0.25 * fastest / step)), max(_FEWEST_SAMPLES, math.ceil(duration / step)))


def _closer(trial: Experiment, search: _Search, sampling: _Sampling) -> tuple[Identification, Response]:
    width = sampling.width if search.kind != "chirp" else sampling.step * max(64, sampling.samples // 8)
    made = trial.excitation(search.kind, search.amplitude, width, sampling.step)
    response = trial.respond(made, sampling.step, sampling.samples, search=search.search)
    response = trial.converged(response, sampling.step)
    record = free_response(response.values, float(response.time[1]), trial.plant.outputs, response.error)
    return identify(record, smallest_share=search.smallest_share), response


def _is_same(before: Identification, found: Identification, trial: Experiment) -> bool:
    """Whether a closer look has changed nothing of importance: the fastest and slowest period and the slowest decay."""
    if len(before.modes) != len(found.modes):
        return False

    def scales(one: Identification) -> list[float]:
        sampling = _sampling(one, 1.0, trial)
        return [sampling.step, sampling.step * sampling.samples]

    return all(abs(math.log(a / b)) < math.log(_SETTLED_ENOUGH) for a, b in zip(scales(before), scales(found), strict=True))


def _findings(response: Response, trial: Experiment, unrest: str | None) -> list[Finding]:
    found = [Finding("no_rest", unrest)] if unrest else []
    if trial.settling.problem is not None:
        found.append(Finding("state_lost", trial.settling.problem))
    if response.nonlinearity > TOLERATED:
        size = f"{response.excitation.amplitude:.3g} {trial.plant.input_unit}"
        text = (
            f"the plant is too nonlinear: about half the excitation of {size} "
            f"changes the response per amplitude by {response.nonlinearity:.2g} of it (tolerated: {TOLERATED:g}); the modes are "
            "those of this amplitude"
        )
        found.append(Finding("nonlinear", text))
    if response.coupling > 1e-3:
        text = f"the communication step still changes the response by {response.coupling:.1e} of it, as far as it was divided"
        found.append(Finding("coupling", text))
    return found


def _compared(
    trial: Experiment, found: Identification, response: Response, smallest_share: float
) -> tuple[LinearComparison | None, list[Finding]]:
    """The comparison with the FMU's linearization at the operating point, if there is one at rest, and its findings."""
    try:
        linearization = linearize(trial.plant, point=trial.point, settle_time=trial.settle_time)
        if linearization.at_rest:
            compared = compare(linearization, found, response.excitation, response.nonlinearity, smallest_share)
            return compared, [Finding("linearized", compared.text)]
        moment, unrest = linearization.time, linearization.unrest
        why = f"at t = {moment:g} s its states are {unrest:.1e} of their size from rest (at most {AT_REST:g})"
    except NoLinearizationError:
        return None, []
    except ShaperFmuError as error:
        why = str(error)
    return None, [Finding("not_linearized", f"the modes are not compared with the FMU's linearization: {why}")]

"""Tunes shapers for several inputs of a plant: one for each, or a common one, verified alone and with all commands at once."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ArgumentError, ComponentError, SimulationError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.slips import checked_names
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.reasons import percent
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.kept_runs import FILE
from shaper_fmu.tune.meter import Budget, BudgetError, Effort, Meter
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.tuning import Say, Tuning, Verdict, requirements_for
from shaper_fmu.tune.tuning_inputs_again import chosen_again, with_common
from shaper_fmu.tune.tuning_plant import at_work, tune_plant
from shaper_fmu.tune.tuning_trial import integrators
from shaper_fmu.tune.verification.command import MOST_INTEGRATORS, command_for
from shaper_fmu.tune.verification.swing import SlowPart, slow_part
from shaper_fmu.tune.verification.together import MOST_INPUTS, Shaped, verify_together
from shaper_fmu.tune.verification.verify import Verification

_LITTLE, _CLOSER = 1.5, 0.97
"""What all together may leave over the tolerance for a second try, and what of the tolerance that aims at."""
_WITH_SHAPER: tuple[Verdict, ...] = ("tuned", "not_held", "not_verified", "not_proven")


@dataclass(frozen=True, repr=False)
class InputsTuning:
    """Shapers for several inputs.

    Attributes:
        verdict: `tuned` if all inputs are, or need none, and the commands together leave no more than the tolerance; else that of
            the first input that is not good, or of the verification together.
        together_words: what all commands at once leave, or why that is not known.
        tunings: of each input, by its name, with the others at rest.
        together: all commands at once, with the worst signs; None where it could not be done, or one input alone has a shaper.
        inputs: commands and shapers of that; () without.
        common: whether one shaper is for all inputs.
        stopped: the Ctrl-C after which no further run was begun.
        effort: of the verification together.
    """

    verdict: Verdict
    together_words: str
    tunings: Mapping[str, Tuning]
    together: Verification | None
    inputs: tuple[Shaped, ...]
    common: bool
    stopped: KeyboardInterrupt | None = None
    effort: Effort = field(default_factory=Effort, compare=False)

    def __repr__(self) -> str:
        return f"<InputsTuning: {self.verdict.replace('_', ' ')}; {'; '.join(map(repr, self.tunings.values()))}>"

    @property
    def summary(self) -> str:
        """The result of each input, and of all together, in a few sentences."""
        return ". ".join([*(f"{name}: {one.summary}" for name, one in self.tunings.items()), self.together_words])

    @property
    def source(self) -> str:
        """The plant's file."""
        return next(iter(self.tunings.values())).source

    @property
    def input(self) -> str:
        """The names of all inputs."""
        return ", ".join(self.tunings)

    @property
    def good(self) -> bool:
        """Whether nothing more is to be done."""
        return self.verdict in ("tuned", "no_vibration")


def folder_name(input: str) -> str:
    """An input's name as that of a folder."""
    return re.sub(r"[^\w.\-]+", "_", input).strip("_")


def tune_inputs(
    source: System | Fmu | Path | str,
    inputs: Sequence[str],
    outputs: Sequence[str] | None = None,
    *,
    common: bool = False,
    requirements: Requirements | None = None,
    spread: Mapping[str, float] | None = None,
    amplitude: float | None = None,
    start_values: Mapping[str, Any] | None = None,
    start: Mapping[str, Any] | None = None,
    say: Say = lambda _: None,
    budget: Budget | None = None,
    keep: Path | str | None = None,
    resume: bool = False,
    workers: int = 1,
    hear: Callable[..., None] | None = None,
    **options: Any,
) -> InputsTuning:
    """Find a shaper for each of several inputs, so that the outputs do not vibrate, whichever inputs get commands.

    Each input is excited alone, and its shaper is verified alone, by `tune_plant`. Then all inputs get their commands at once, with
    all signs, each behind its shaper: a mode that one input excites is seen in all outputs (see `verify_together`).

    Args:
        source: an FMU, or a system whose inputs are free.
        inputs: 2 to 4 names.
        common: whether one shaper, for the modes of all inputs, stands before each.
        keep: folder for the kept runs: a file in a folder for each input, and one for all together.
        outputs, requirements, spread, amplitude, start_values, start, say, budget, resume, workers, hear, options: of `tune_plant`.

    Raises as `tune_plant` does, and ArgumentError for moves, for fewer or more inputs, and for one named twice.
    """
    spread = dict(spread or {})
    check_inputs(inputs, spread)
    requirements = requirements or requirements_for(spread)
    if requirements.move is not None:
        raise ArgumentError("a move is for one input: tune each input alone, with its own move")
    plants = {name: Plant(source, name, outputs, start_values).beginning(start or {}) for name in inputs}
    for plant in plants.values():
        plant.nominal_values(spread)
    meter, tunings = Meter(budget), {}
    for number, (name, plant) in enumerate(plants.items()):
        say(f"note: input {name}, with the others at rest")
        limits = _share(meter.left(), len(plants) + 1 - number)
        file = Path(keep) / folder_name(name) / FILE if keep is not None else None
        try:
            tunings[name] = tune_plant(
                plant, requirements=requirements, spread=spread, amplitude=amplitude, say=say, budget=limits, keep=file,
                resume=resume and file is not None and file.is_file(), workers=workers, hear=hear, **options,
            )  # fmt: skip
        except BudgetError:
            if plant.meter.stopped is not None and not tunings:
                raise plant.meter.stopped from None
            if not tunings:
                raise
        meter.merge(plant.meter.efforts)
        meter.stopped = plant.meter.stopped
        if name not in tunings or meter.stopped is not None:
            break
    if common and len(tunings) == len(inputs):
        tunings = with_common(tunings, requirements, say)
    first = next(iter(plants.values()))
    first.meter, before = meter, meter.whole
    file = Path(keep) / FILE if keep is not None else None
    facts = {**first.facts(spread), "the input": ", ".join(inputs)}
    with at_work(first, file, facts, resume=resume and file is not None and file.is_file(), workers=workers, say=say):
        found = _alone(tunings, common)
        left_out = [name for name in inputs if name not in tunings]
        if left_out:
            words = f"the budget or an interrupt left out {' and '.join(left_out)}"
            return replace(found, verdict="not_verified", together_words=words, stopped=meter.stopped)
        found = _together(found, requirements, spread, say)
        tighter = _tighter(found, requirements)
        if tighter is not None:
            tunings = chosen_again(tunings, requirements, tighter, say, common=common)
            again = _together(_alone(tunings, common), requirements, spread, say)
            found = again if again.good else found
    taken, found = meter.whole, _marked(found)
    return replace(found, stopped=meter.stopped, effort=Effort(taken.steps - before.steps, taken.runs - before.runs))


def check_inputs(inputs: Sequence[str], spread: Mapping[str, float]) -> None:
    """Raise ArgumentError for fewer or more inputs than can be tuned together, for one named twice, and for one that varies."""
    checked_names("inputs", inputs)
    if not 2 <= len(inputs) <= MOST_INPUTS or len(set(inputs)) < len(inputs):
        raise ArgumentError(
            f"inputs = {', '.join(inputs)}: 2 to {MOST_INPUTS} different ones are needed; one alone is for tune_plant"
        )
    varied = [name for name in inputs if name in spread]
    if varied:
        raise ArgumentError(f"{varied[0]} gets commands, so that it cannot vary as a value that is held; leave it out of the range")


def _share(left: Budget, parts: int) -> Budget:
    return Budget(
        None if left.steps is None else left.steps // parts, None if left.seconds is None else left.seconds / parts
    )  # fmt: skip


def _alone(tunings: Mapping[str, Tuning], common: bool) -> InputsTuning:
    """The result of the inputs alone."""
    bad: list[Verdict] = [one.verdict for one in tunings.values() if not one.good]
    none = all(one.verdict == "no_vibration" for one in tunings.values())
    verdict: Verdict = "no_vibration" if none else "tuned"
    if bad:
        verdict = bad[0]
    return InputsTuning(verdict, "no input has a shaper, so that there is nothing to verify together", tunings, None, (), common)


def _together(found: InputsTuning, asked: Requirements, spread: Mapping[str, float], say: Say) -> InputsTuning:
    """The tuning with what all commands at once leave."""
    tunings = found.tunings
    shaped = {name: one for name, one in tunings.items() if one.candidate is not None and one.verdict in _WITH_SHAPER}
    if not shaped:
        return found
    missing = [name for name, one in tunings.items() if name not in shaped and one.verdict != "no_vibration"]
    if missing:
        return _untried(found, f"{' and '.join(missing)} has no shaper ({tunings[missing[0]].verdict.replace('_', ' ')})")
    say("verifying all inputs together")
    try:
        inputs, outputs = _inputs(tunings)
        if not outputs:
            return _untried(found, "no output settles after the commands of all inputs")
        boxes = [box for one in shaped.values() if one.choice is not None for box in one.choice.boxes]
        plant = next(iter(tunings.values())).system
        assert plant is not None
        with plant.meter.part("verify"):
            seen = verify_together(inputs, outputs, boxes, spread, tolerance=asked.tolerance, slow=_slow(tunings, outputs))
    except (ComponentError, SimulationError, BudgetError) as error:
        return _untried(found, str(error))
    sizes = " and ".join(
        f"{one.command.amplitude:.4g} {one.plant.input_unit}".rstrip() + f" of {one.plant.short(one.plant.input)}" for one in inputs
    )
    nominally = seen.nominal.share + seen.uncertainty <= asked.nominal_tolerance
    holds = seen.holds and nominally
    failed = "" if nominally else f"; nominally that is more than the nominal tolerance of {percent(asked.nominal_tolerance)}"
    verdict: Verdict = found.verdict
    if found.good and not holds:
        verdict = "not_held"
    words = f"all commands at once ({sizes}, with the worst signs): {seen.reason}{failed}"
    return replace(found, verdict=verdict, together_words=words, together=seen, inputs=tuple(inputs))


def _marked(found: InputsTuning) -> InputsTuning:
    """The same, where inputs that are good alone have the verdict of all together: their files tell it."""
    if found.good:
        return found
    told = f". With all inputs together: {found.verdict.replace('_', ' ')}, see the summary of these"
    tunings = {
        name: replace(one, verdict=found.verdict, summary=f"{one.summary}{told}") if one.verdict == "tuned" else one
        for name, one in found.tunings.items()
    }
    return replace(found, tunings=tunings)


def _untried(found: InputsTuning, why: str) -> InputsTuning:
    verdict: Verdict = found.verdict
    if found.good:
        verdict = "not_verified"
    return replace(found, verdict=verdict, together_words=f"the inputs could not be verified together: {why}")


def _inputs(tunings: Mapping[str, Tuning]) -> tuple[list[Shaped], list[str]]:
    """Commands of all inputs, which leave at rest what can be, and the outputs that settle after all of them."""
    names = list(dict.fromkeys(name for one in tunings.values() for name in one.outputs))
    depths = {
        name: [integrators(one.plant, one.system.full(name)) for one in tunings.values() if one.plant and one.system]
        for name in names
    }
    outputs = [name for name in names if max(depths[name]) <= MOST_INTEGRATORS]
    start, inputs = max(one.command.start for one in tunings.values()), []
    for number, one in enumerate(tunings.values()):
        assert one.system is not None
        deepest = max((depths[name][number] for name in outputs), default=0)
        boxes = one.choice.boxes if one.choice is not None else _boxes(tunings)
        command = command_for(boxes, one.command.rest, one.command.amplitude, start, deepest)
        inputs.append(Shaped(one.system, command, one.candidate))
    return inputs, outputs


def _boxes(tunings: Mapping[str, Tuning]) -> list[ModeBox]:
    return [box for one in tunings.values() if one.choice is not None for box in one.choice.boxes]


def _slow(tunings: Mapping[str, Tuning], outputs: Sequence[str]) -> SlowPart:
    """The poles of all inputs' experiments."""
    parts = [
        slow_part(one.plant, [one.system.full(name) for name in outputs])
        for one in tunings.values()
        if one.plant is not None and one.system is not None and one.plant.nominal.modes
    ]
    calm, reals = ([pole for part in parts for pole in getattr(part, name)] for name in ("calm", "reals"))
    return SlowPart(tuple(pole for part in parts for pole in part.modes), tuple(calm), tuple(reals))


def _tighter(found: InputsTuning, asked: Requirements) -> Requirements | None:
    """Tighter requirements, where each input holds alone, and all together leave a little too much; else None."""
    seen = found.together
    if seen is None or found.verdict != "not_held" or not all(one.good for one in found.tunings.values()) or seen.failed:
        return None
    over = [
        max(1.0, (one.share + seen.uncertainty) / limit)
        for one, limit in ((seen.worst, asked.tolerance), (seen.nominal, asked.nominal_tolerance))
    ]
    if max(over) > _LITTLE:
        return None
    wide, nominal = (
        limit if much == 1.0 else _CLOSER * limit / much
        for limit, much in zip((asked.tolerance, asked.nominal_tolerance), over, strict=True)
    )
    return replace(asked, tolerance=wide, nominal_tolerance=min(wide, nominal))

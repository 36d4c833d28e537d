"""Tunes a shaper for a plant: identifies its modes, chooses a shaper, and verifies it on the plant."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ArgumentError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.renamed import renamed_argument
from shaper_fmu.slips import checked_mapping, checked_number
from shaper_fmu.tune.choice.boxes import ModeBox, mode_boxes
from shaper_fmu.tune.choice.choice import choose, choose_another
from shaper_fmu.tune.choice.reasons import percent
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import fits, preferred
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.identify.experiment import experiment
from shaper_fmu.tune.identify.range import PlantModes, identify_plant
from shaper_fmu.tune.kept_runs import KeptRuns, Memory
from shaper_fmu.tune.meter import Budget, BudgetError, Meter, Part
from shaper_fmu.tune.plan import Cost, Plan, measured_cost, of_modes, plan_for
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.tuning import AGAINST_NO_VIBRATION, Say, Tuning, Verdict, check_options, requirements_for
from shaper_fmu.tune.tuning_amplitude import modes_over_command, swings_at_size
from shaper_fmu.tune.tuning_trial import integrators, shortfall, tightened, tried, untried
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.move import order_of_input
from shaper_fmu.tune.workers.workers import Workers

_UNSTABLE = ("unstable", "growth")
_MORE_ATTEMPTS = 4
"""Shapers that are tried after the first one, if the plant leaves a little more than its modes."""


@renamed_argument("wish", "requirements")
def tune_plant(
    source: Plant | System | Fmu | Path | str,
    input: str = "",
    outputs: Sequence[str] | None = None,
    *,
    requirements: Requirements | None = None,
    spread: Mapping[str, float] | None = None,
    amplitude: float | None = None,
    start_values: Mapping[str, Any] | None = None,
    start: Mapping[str, Any] | None = None,
    settle: float = 0.0,
    say: Say = lambda _: None,
    budget: Budget | None = None,
    hear: Callable[[Part, int, int], None] | None = None,
    keep: Path | str | None = None,
    resume: bool = False,
    workers: int = 1,
    **options: Any,
) -> Tuning:
    """Find a shaper for an FMU's or a system's `input`, so that its `outputs` do not vibrate after a command.

    Args:
        source: an FMU, or a system whose input is free; in a system names are "instance.variable". Or a `Plant` made of them.
        input, outputs: names; all real outputs that vibrate if none are named.
        requirements: what is wanted; by default `requirements_for(spread)`.
        spread: parameters of the plant and by which share each varies: {"mass": 0.1} for +-10 % of its start value. The modes are
            identified with the nominal values and in all corners; in the verification all of them vary.
        amplitude: of the command's step in the verification, in the input's unit; by default as in the experiment's first try.
        start_values: of an FMU given alone.
        start: values with which the plant begins, by name, of a system's variables, too: its states, and inputs that nothing feeds.
        settle: time that the plant needs from there until it rests, before each experiment and command [s].
        budget: what the experiments may take. The plan is told by `say` beforehand. What does not fit any more is left out:
            then the verdict is `not_verified`. Ctrl-C within a run of the plant ends the budget: what is known is kept.
        hear: called after each run of the plant with the part at work, the steps it has taken, and those that are expected of it.
        keep: file in which the plant's runs are kept (SQLite), each as soon as it is made.
        resume: whether to take the runs that are in that file, which take no steps then: a tuning that was interrupted, or whose
            budget was spent, goes on, and its result is that of one that was not, bit for bit. Else they are deleted.
        workers: processes in which the plant is run at once, at the points of the range and of the verification; with 1 it is this
            process alone. The result has the same bits. An FMU that ends its worker has failed at that point.
        options: of `experiment`.

    With a move in the requirements profiles are compared, too, and the plant makes the move. `Tuning.efforts` tells the steps
    of the plant and the time that each part has taken.

    Raises BudgetError where the budget allows no modes to be found, IdentificationError where the experiments do not support an
    answer, ModelError for wrong names, SimulationError if the plant cannot be run, ArgumentError where the runs to resume from are
    those of another plant, input, range or version.
    """
    check_options(options, experiment)
    checked_mapping("spread", spread, '{"mass": 0.1} for 10 %')
    checked_mapping("start", start, '{"angle": 0.1}')
    for name, share in (spread or {}).items():
        checked_number(f"spread of {name}", share)
    if amplitude is not None:
        checked_number("amplitude", amplitude)
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise ArgumentError(f"workers = {workers!r:.80}: a number of processes, at least 1, is needed")
    if requirements is not None and not isinstance(requirements, Requirements):
        raise ArgumentError(f"requirements = {requirements!r:.80}: Requirements are needed, such as requirements_for(spread)")
    spread = dict(spread or {})
    requirements = requirements or requirements_for(spread)
    requirements.check_impulses_only()
    plant = Plant.of(source, input, outputs, start_values).beginning(start or {})
    options["settle"] = settle
    plant.meter, plant.memory = Meter(budget), Memory()
    if requirements.move is not None:
        order_of_input(plant, requirements.move)  # refuses what cannot follow a move
    moves = requirements.move is not None
    check_budget(plant, spread, plant.meter.budget, moves)
    plan = _plan(plant, spread, measured_cost(plant), moves)
    say(f"note: {plan.words()}")
    plant.meter.hear, plant.meter.expected = hear, {name: one.steps for name, one in plan.usual.items()}
    plan.check(plant.meter.budget)
    if keep is None and resume:
        raise ArgumentError("resume = True needs a file to go on from: keep = ...")
    with at_work(plant, keep, plant.facts(spread), resume=resume, workers=workers, say=say):
        return replace(_tuned(plant, requirements, spread, amplitude, say, options), efforts=plant.meter.efforts)


@contextmanager
def at_work(
    plant: Plant, keep: Path | str | None, facts: Mapping[str, str], *, resume: bool, workers: int, say: Say
) -> Iterator[None]:
    """The plant with a file for its runs, and with worker processes. See `tune_plant` and `KeptRuns`."""
    if keep is not None:
        kept = plant.kept = KeptRuns(keep, facts, resume=resume)
        if kept.resumed:
            say(f"note: {kept.resumed} runs of the plant are known from {keep}, and take no steps")
        elif kept.replaced:
            say(f"note: the {kept.replaced} runs of an earlier tuning in {keep} are replaced")
    plant.workers = Workers(workers) if workers > 1 else None
    try:
        yield
    finally:
        if plant.workers is not None:
            plant.workers.close()
        if plant.kept is not None:
            plant.kept.close()
        plant.workers = plant.kept = None
        plant.ahead = {}


def check_budget(plant: Plant, spread: Mapping[str, float], budget: Budget, moves: bool = False) -> None:
    """Raise BudgetError where not even the least fits the budget of steps, with `moves` for a move; the plant is not run."""
    _plan(plant, spread, Cost(), moves).check(budget)


def _plan(plant: Plant, spread: Mapping[str, float], cost: Cost, moves: bool) -> Plan:
    points = corners(plant.nominal_values(spread), spread)
    return plan_for(len(points), sum(share > 0.0 for share in spread.values()), cost, moves)


def _tuned(
    plant: Plant,
    requirements: Requirements,
    spread: Mapping[str, float],
    amplitude: float | None,
    say: Say,
    options: Mapping[str, Any],
) -> Tuning:
    say("identifying the modes")
    modes = identify_plant(plant, points=corners(plant.nominal_values(spread), spread), **options)
    names = [plant.short(name) for name in (plant.outputs if plant.named else _vibrating(modes))]
    rest = plant.rest_value({})
    size = amplitude if amplitude is not None else plant.first_amplitude(rest)
    step = Command(rest, size, modes.nominal.settle_time)
    found = Tuning(
        "tuned", "", plant.name, plant.short(plant.input), plant.input_unit, step,
        tuple(names), spread, plant, modes, None, None, None, (), modes.findings,
    )  # fmt: skip
    hopeless = hopeless_verdict(modes)
    if hopeless is not None and hopeless[0] == "no_vibration":
        nominal = corners(plant.nominal_values(spread), spread)[0]
        moving = swings_at_size(plant, modes.nominal, nominal, size, options)
        hopeless = ("not_proven", f"no mode of vibration was found at the nominal point, but {moving}") if moving else hopeless
    if hopeless is not None:
        return replace(found, verdict=hopeless[0], summary=hopeless[1])
    say("choosing a shaper")
    boxes = mode_boxes(modes, [plant.full(name) for name in names])
    with plant.meter.part("choose"):
        choice = choose(boxes, requirements)
    if choice.recommended is None:
        return replace(found, verdict="nothing_fits", summary=choice.reason, choice=choice)
    found = _verified(replace(found, choice=choice), boxes, requirements, plant, say)
    if found.verdict == "not_held" and requirements.move is None:
        found = _over_command(found, requirements, plant, size, say, options)
        modes = found.plant or modes
    missing = "; ".join(one.text for one in modes.uncovered)
    if not missing:
        return found
    if found.verdict == "tuned" and any(one.code == "left_out" for one in modes.uncovered):
        found = replace(found, verdict="not_verified")
    return replace(found, summary=f"{found.summary}. The ranges of the modes do not cover all that was asked for: {missing}")


def _over_command(found: Tuning, asked: Requirements, plant: Plant, size: float, say: Say, options: Mapping[str, Any]) -> Tuning:
    """Of a nonlinear plant the tuning for its modes over the whole command; the given one where they stay, or nothing fits.

    A plant with integrators moves on when its input is held, and is left out.
    """
    assert found.plant is not None
    if any(integrators(found.plant, plant.full(name)) for name in found.outputs):
        return found
    say("identifying the modes over the command")
    points = corners(plant.nominal_values(found.spread), found.spread)
    modes = modes_over_command(plant, points, size, options)
    if modes is None:
        return found
    ends = " and ".join(f"{one.natural_frequency.low:.4g} to {one.natural_frequency.high:.4g}" for one in modes.ranges)
    told = f"the modes change with the command: over a step of {size:.4g} {found.input_unit}".rstrip() + f" they are {ends} rad/s"
    boxes = mode_boxes(modes, [plant.full(name) for name in found.outputs])
    with plant.meter.part("choose"):
        choice = choose(boxes, asked)
    if choice.recommended is None:
        return replace(found, summary=f"{found.summary}. It is nonlinear: {told}, and for these {choice.reason}")
    wider = replace(found, plant=modes, choice=choice, verification=None, responses=(), findings=modes.findings)
    again = _verified(wider, boxes, asked, plant, say)
    return replace(again, summary=f"{again.summary}. It is nonlinear: {told}, and the shaper is for that range")


def _verified(found: Tuning, boxes: Sequence[ModeBox], asked: Requirements, plant: Plant, say: Say) -> Tuning:
    """The tuning with the first shaper that holds on the plant, or with the last one tried.

    A plant that leaves a little too much gets what is next: of the other candidates that fit by their bounds, and of those for
    tolerances that are tighter by what the plant left too much, the shortest.
    """
    first = found.choice
    assert first is not None
    say("verifying it on the plant")
    try:
        found = tried_within(found, asked, plant)
    except BudgetError as error:
        return untried(found, str(error))
    refuted: list[tuple[Candidate, str]] = []
    for _ in range(_MORE_ATTEMPTS):
        tighter = tightened(found, asked) if found.verdict == "not_held" else None
        if tighter is None or found.candidate is None:
            break
        refuted.append((found.candidate, shortfall(found, asked)))
        known = {id(one) for one, _ in refuted}
        others = [one for one in first.candidates if fits(one, asked) and id(one) not in known]
        with plant.meter.part("choose"):
            choice = choose(boxes, tighter)
        wanted = [*others, *([choice.recommended] if choice.recommended is not None else [])]
        if not wanted:
            break
        best = preferred(wanted, asked)
        if best is choice.recommended:
            say(f"choosing again, for {percent(tighter.tolerance)} and nominally {percent(tighter.nominal_tolerance)}")
        else:
            say(f"trying {best.name}")
            choice = choose_another(first, best, refuted)
        say("verifying it on the plant")
        try:
            found = tried_within(replace(found, choice=choice, verification=None, responses=()), asked, plant)
        except BudgetError as error:
            return replace(found, summary=f"{found.summary}. No other shaper is tried: {error}")
    return found


def tried_within(found: Tuning, asked: Requirements, plant: Plant) -> Tuning:
    """The tuning with what simulations of the plant show; raises BudgetError before them, if these do not fit the budget."""
    with plant.meter.part("verify"):
        if found.choice is not None:
            varied = sum(share > 0.0 for share in found.spread.values())
            nearest, moves = found.choice.nearest, asked.move is not None
            lasting = nearest.delay
            if nearest.profile is not None:
                lasting = nearest.profile.duration + nearest.sequence.duration
            modes = found.choice.boxes, varied, lasting, found.command.start
            taken = plant.meter.efforts["verify"].steps
            plant.meter.expected["verify"] = taken + of_modes(*modes, usual=True, moves=moves).steps
            plant.meter.allow(of_modes(*modes, moves=moves).steps, "verifying the shaper on the plant")
        return tried(found, asked, plant)


def corners(nominals: Mapping[str, float], spread: Mapping[str, float]) -> list[dict[str, float]]:
    """The nominal point, and each combination of least and largest values of what varies."""
    varied = {name: share for name, share in spread.items() if share > 0.0}
    ends = [(nominals[name] * (1.0 - share), nominals[name] * (1.0 + share)) for name, share in varied.items()]
    points = [{name: nominals[name] for name in varied}]
    return points + [dict(zip(varied, place, strict=True)) for place in itertools.product(*ends) if varied]


def _vibrating(modes: PlantModes) -> list[str]:
    """Outputs with a visible mode; all of them if there are none."""
    found = [abs(mode.residues[0]) for mode in modes.nominal.modes]
    seen = [name for j, name in enumerate(modes.nominal.outputs) if any(sizes[j] > 0.0 for sizes in found)]
    return seen or list(modes.nominal.outputs)


def hopeless_verdict(modes: PlantModes) -> tuple[Verdict, str] | None:
    """Why there is nothing to choose, if that is so."""
    nonlinear = [one.text for one in modes.findings if one.code == "nonlinear"]
    for one in modes.findings:
        if one.code in _UNSTABLE and nonlinear:  # poles that fit no linear motion may grow where nothing does
            return "not_proven", f"{one.text}, but poles prove nothing here: {'; '.join(nonlinear)}"
        if one.code in _UNSTABLE:
            text = "no command shaper can help a plant that is unstable: stabilise it by feedback first, and tune the closed loop"
            return "unstable", f"{one.text}; {text}"
    if modes.nominal.modes:
        return None
    against = [one.text for one in modes.findings if one.code in AGAINST_NO_VIBRATION]
    against += [one.linear.text for one in modes.experiments if one.linear is not None and not one.linear.agrees]
    if against:
        return "not_proven", f"no mode of vibration was found at the nominal point, but {'; '.join(against)}"
    texts = [one.text for one in modes.findings if one.code in ("no_vibration", "overdamped")]
    return "no_vibration", "; ".join(texts) or "no mode of vibration was found; no shaper is needed"

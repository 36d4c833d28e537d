"""Verifies the recommended shaper on the plant, and tightens the requirements if the plant leaves a little too much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shaper_fmu.analysis.identification import Finding
from shaper_fmu.errors import ComponentError, SimulationError
from shaper_fmu.tune.choice.reasons import percent, percent_beside
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.identify.range import PlantModes
from shaper_fmu.tune.meter import BudgetError
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.tuning import Tuning, Verdict
from shaper_fmu.tune.verification.command import MOST_INTEGRATORS, command_for
from shaper_fmu.tune.verification.move import MoveCommand, move_command, order_of_input
from shaper_fmu.tune.verification.responses import simulated_responses
from shaper_fmu.tune.verification.swing import slow_part
from shaper_fmu.tune.verification.verify import verify

_CLOSER = 0.97
"""What of the tolerance a tighter design aims at, so that the plant, which is not quite its modes, keeps it."""
_MOST_TIGHTENED = 0.5
_POLES_AT_0 = {"offset": 1, "drift": 2, "acceleration": 3}
_OF_EXCITATION = {"pulse": 0, "chirp": 0, "step": -1, "doublet": 1}
"""Integrators that are seen, less those of the plant: a pulse is the derivative of a step, a doublet that of a pulse."""
_SEEN = 1e-6
"""Share of the vibration's amplitude above which a motion of a rigid body is one, and not rounding."""


def tried(found: Tuning, asked: Requirements, plant: Plant) -> Tuning:
    """The tuning with what simulations of the plant behind the shaper have shown."""
    assert found.plant is not None
    assert found.choice is not None
    choice = found.choice
    depths = {name: integrators(found.plant, plant.full(name)) for name in found.outputs}
    move, given = asked.move, found.command
    most = MOST_INTEGRATORS if move is None else order_of_input(plant, move)
    settling = [name for name, depth in depths.items() if depth <= most]
    if not settling:
        return untried(
            found,
            f"{' and '.join(found.outputs)} move on for ever, whatever the command to {found.input} (a rigid body), so there is "
            "no rest to compare with; name an output that comes to rest, such as a deflection",
        )
    if move is None:
        deepest = max(depths[name] for name in settling)
        command = command_for(choice.boxes, given.rest, given.amplitude, given.start, deepest)
    else:
        command = move_command(plant, move, choice.boxes, given.rest, given.start, given.amplitude)
    found, modes = replace(found, command=command), found.plant
    try:
        slow = slow_part(modes, [plant.full(name) for name in settling])
        seen = verify(
            plant, "", settling, choice.nearest, choice.boxes, found.spread,
            tolerance=asked.tolerance, command=command, slow=slow,
        )  # fmt: skip
    except ComponentError as error:
        return untried(found, str(error))
    except SimulationError as error:
        assert found.plant is not None
        unit = f" {found.input_unit}" if found.input_unit else ""
        return untried(
            found,
            f"a {command.name} {'with' if move else 'of'} {command.amplitude:.5g}{unit} fails: {error}. Give the size of the "
            f"commands (amplitude); in "
            f"the experiments it was {found.plant.nominal.excitation.amplitude:.3g}{unit}",
        )
    cases = {"nominal": seen.nominal} | ({"worst": seen.worst} if seen.worst is not seen.nominal else {})
    try:
        responses = tuple(
            simulated_responses(plant, settling, choice.nearest, choice.boxes, command, case, one.values, seen.step)
            for case, one in cases.items()
        )
    except BudgetError as error:
        responses, lost = (), Finding("left_out", f"the responses before and after are not shown: {error}")
        found = replace(found, findings=(*found.findings, lost))
    designed = f"{percent(choice.requirements.tolerance)} and nominally {percent(choice.requirements.nominal_tolerance)}"
    closer = f". It is designed for {designed}, so that the plant meets the requirements" if choice.requirements != asked else ""
    found = replace(found, verification=seen, responses=responses)
    failed = shortfall(found, asked)
    verdict: Verdict = "not_held" if failed else "tuned"
    lead = f"{failed}. For the modes found, " if failed else ""
    unnamed = f". {found.input} has no unit and is taken for a position" if move is not None and not found.input_unit else ""
    return replace(
        found, verdict=verdict, summary=f"{lead}{choice.reason}{closer}. On the plant: {seen.reason}{arrival(found)}{unnamed}"
    )


def arrival(found: Tuning) -> str:
    """When the outputs of the nominal plant have come to stay within the tolerance, and when the move was told to end."""
    command, candidate, seen = found.command, found.candidate, found.verification
    if (
        not isinstance(command, MoveCommand)
        or candidate is None
        or candidate.profile is None
        or seen is None
        or not found.responses
    ):
        return ""
    assert found.choice is not None
    told, tolerance = candidate.profile.duration + candidate.sequence.duration, found.choice.requirements.tolerance
    nominal = found.responses[0]
    late = 0.0
    for name, before in zip(seen.outputs, seen.nominal.before, strict=True):
        values, after = nominal.outputs[name][1], nominal.time >= told
        middle = 0.5 * (values[after].max() + values[after].min())
        late = max(late, _last_above(nominal.time, np.abs(values - middle), tolerance * before))
    return f". The nominal plant has arrived within the tolerance {late:.4g} s after the move's begin; the move takes {told:.4g} s"


def _last_above(time: np.ndarray, sizes: np.ndarray, limit: float) -> float:
    """When sizes (n,) at times (n,) fall below a limit for good, between the samples; 0 if they never are above it."""
    above = np.flatnonzero(sizes > limit)
    if not len(above):
        return 0.0
    last = int(above[-1])
    if last + 1 == len(time):
        return float(time[last])
    part = (sizes[last] - limit) / (sizes[last] - sizes[last + 1])
    return float(time[last] + part * (time[last + 1] - time[last]))


def shortfall(found: Tuning, asked: Requirements) -> str:
    """What the plant's simulations do not hold, each tolerance by its name; "" if they hold all that was asked for."""
    seen = found.verification
    assert seen is not None
    parts = []
    over = "over the range of the parameters" if found.spread else "on the plant"
    shares = [(over, "tolerance", seen.worst.share, asked.tolerance)]
    if asked.nominal_stricter:
        shares.append(("nominally", "nominal tolerance", seen.nominal.share, asked.nominal_tolerance))
    for where, name, share, limit in shares:
        if share > limit:
            parts.append(f"{where} it leaves {percent_beside(share, limit)}, more than the {name} of {percent(limit)}")
        elif share + seen.uncertainty > limit:
            known = f"{percent(share)} +- {percent(seen.uncertainty)}"
            parts.append(f"{where} it leaves {known}, so that the {name} of {percent(limit)} is not shown to hold")
    if seen.failed:
        parts.append(f"at {len(seen.failed)} places the plant could not be run")
    if parts and asked.nominal_stricter and seen.holds:
        parts.append(f"{over} it leaves {percent(seen.worst.share)}, within the tolerance of {percent(asked.tolerance)}")
    return "; ".join(parts)


def untried(found: Tuning, why: str) -> Tuning:
    """The tuning that could not be verified, and why."""
    assert found.choice is not None
    summary = f"for the modes found, {found.choice.reason}. It could not be tried on the plant: {why}"
    return replace(found, verdict="not_verified", summary=summary)


def tightened(found: Tuning, asked: Requirements) -> Requirements | None:
    """Tighter requirements, if the tried shaper leaves a little too much on the plant; None if it leaves much more.

    What the plant leaves over what was proven for its modes is taken to stay: half a peak-to-peak value is not an envelope, and
    a plant is not quite its modes.
    """
    assert found.choice is not None
    assert found.verification is not None
    seen, candidate, requirements = found.verification, found.choice.nearest, found.choice.requirements
    tolerance, nominal = requirements.tolerance, requirements.nominal_tolerance
    worst, nominally = (one.share + seen.uncertainty for one in (seen.worst, seen.nominal))
    if worst > asked.tolerance:
        tolerance = min(tolerance, _CLOSER * asked.tolerance * candidate.worst_case / worst)
    if nominally > asked.nominal_tolerance:
        nominal = min(nominal, _CLOSER * asked.nominal_tolerance * candidate.nominal / nominally)
    if seen.failed or tolerance < _MOST_TIGHTENED * asked.tolerance or nominal < _MOST_TIGHTENED * asked.nominal_tolerance:
        return None
    return replace(requirements, tolerance=tolerance, nominal_tolerance=nominal)


def integrators(modes: PlantModes, output: str) -> int:
    """How many poles at 0 there are between the input and an output: after a step it moves on at constant speed for one."""
    nominal = modes.nominal
    place, end = nominal.outputs.index(output), float(nominal.time[-1])
    swinging = sum(abs(mode.residues[0][place]) for mode in nominal.modes)
    powers = {"offset": 0, "drift": 1, "acceleration": 2}
    seen = [
        _POLES_AT_0[one.kind]
        for one in nominal.identification.others
        if one.kind in powers and abs(one.residues[0][place]) * end ** powers[one.kind] > _SEEN * swinging
    ]
    return max(0, max(seen, default=0) + _OF_EXCITATION[nominal.excitation.kind]) if seen else 0

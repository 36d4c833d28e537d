"""Simulations of the plant with the shaper: responses before and after, and the verification."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import UNSHAPED_AND_SHAPED, Figure, Line, label
from shaper_fmu.report.sweep.curves import thinned
from shaper_fmu.report.tune.modes import given, percent
from shaper_fmu.tune.choice.moves import fastest_move
from shaper_fmu.tune.meter import Effort
from shaper_fmu.tune.tuning import Tuning
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.responses import Responses
from shaper_fmu.tune.verification.shares import Measured
from shaper_fmu.tune.verification.verify import Verification

_MOST_POINTS = 20
_MOST_FAILED = 20


def shown_unit(tuning: Tuning, output: str) -> tuple[str, float]:
    """The unit in which people want to see an output, and the factor to it."""
    return tuning.system.display_unit(output) if tuning.system is not None else ("", 1.0)


def response_blocks(tuning: Tuning, shown: Sequence[str]) -> list[Block]:
    """Outputs after the command, with and without the shaper, and the command itself."""
    blocks: list[Block] = []
    if tuning.responses:
        blocks.append(command_figure(tuning, tuning.responses[0]))
    names = ("fastest within limits", "recommended") if isinstance(tuning.command, MoveCommand) else ("unshaped", "shaped")
    for one in tuning.responses:
        where = f" ({given(one.values)})" if one.values else ""
        blocks.append(Text(f"The {'nominal plant' if one.case == 'nominal' else 'worst place that was found'}{where}:"))
        outputs = [name for name in one.outputs if name in shown]
        blocks += [response_figure(tuning, one, output, number, names) for number, output in enumerate(outputs, 1)]
    return blocks


def response_figure(tuning: Tuning, found: Responses, output: str, number: int, names: Sequence[str]) -> Figure:
    """One output over time, without and with what is recommended."""
    unit, factor = shown_unit(tuning, output)
    lines = [
        Line(name, *thinned(found.time, factor * values), style=style)
        for name, values, style in zip(names, found.outputs[output], UNSHAPED_AND_SHAPED, strict=True)
    ]
    title = f"{output} after the command, {'nominal' if found.case == 'nominal' else 'worst case'}"
    return Figure(f"response_{found.case}_{number}", title, "time [s]", label(output, unit), lines)


def command_figure(tuning: Tuning, found: Responses) -> Figure:
    """The command before and after the shaper, in the input's unit."""
    assert tuning.candidate is not None  # it was simulated
    command, sequence = tuning.command, tuning.candidate.sequence
    if isinstance(command, MoveCommand):
        return _move_figure(tuning, command, found)
    starts = np.array(command.times()) - command.start
    jumps = np.diff(command.levels(), prepend=0.0)
    end = 1.3 * (starts[-1] + sequence.duration) or float(found.time[-1])
    begin = -0.05 * end

    def stairs(times: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        order = np.argsort(times, kind="stable")
        levels = command.rest + command.amplitude * np.cumsum([0.0, *steps[order]])
        return np.repeat([begin, *times[order], end], 2)[1:-1], np.repeat(levels, 2)

    lines = [
        Line(name, *stairs(times, steps.ravel()), style=style)
        for name, times, steps, style in zip(
            ("unshaped", "shaped"),
            (starts, np.add.outer(starts, sequence.delays).ravel()),
            (jumps, np.outer(jumps, sequence.amplitudes)),
            UNSHAPED_AND_SHAPED,
            strict=True,
        )
    ]
    return Figure("command", "The command", "time [s]", label(tuning.input, tuning.input_unit), lines)


def _move_figure(tuning: Tuning, command: MoveCommand, found: Responses) -> Figure:
    """The input in the fastest move within the limits, and in the one recommended."""
    candidate = tuning.candidate
    assert candidate is not None
    assert candidate.profile is not None
    law, sequence, fastest = candidate.profile, candidate.sequence, fastest_move(command.move)
    t = np.linspace(-0.05, 1.1, 2001) * max(fastest.duration, law.duration + sequence.duration)
    shaped = sum(
        (a * (command.input_of(law, t - d) - command.rest) for a, d in zip(sequence.amplitudes, sequence.delays, strict=True)),
        np.full(len(t), command.rest),
    )
    lines = [
        Line(name, t, values, style=style)
        for name, values, style in zip(
            ("fastest within limits", "recommended"), (command.input_of(fastest, t), shaped), UNSHAPED_AND_SHAPED, strict=True
        )
    ]
    return Figure("command", "The move", "time [s]", label(tuning.input, tuning.input_unit), lines)


def verification_blocks(tuning: Tuning) -> list[Block]:
    """The points that were simulated, the worst first, and those that failed."""
    found = tuning.verification
    if found is None:
        return []
    blocks: list[Block] = [Text(_how(tuning, found)), points_table(tuning, found)]
    if found.failed:
        rows = [[given(values), reason] for values, reason in found.failed[:_MOST_FAILED]]
        few = f" (the first {_MOST_FAILED} of {len(found.failed)})" if len(found.failed) > _MOST_FAILED else ""
        blocks.append(Table(f"Where the plant could not be run{few}", ["parameters", "why"], rows, left_aligned=True))
    return blocks


def points_table(tuning: Tuning, found: Verification) -> Table:
    """Residuals at the worst points, and at the nominal one."""
    ranked = sorted(found.points, key=lambda one: -one.share)
    shown = ranked[:_MOST_POINTS]
    if not any(one is found.nominal for one in shown):
        shown.append(found.nominal)
    units = [shown_unit(tuning, name) for name in found.outputs]
    kept = sorted(sorted(range(len(found.outputs)), key=lambda j: -_largest(found, j))[:3])
    head = [*found.nominal.values, "share left", *(label(f"{found.outputs[j]} before, after", units[j][0]) for j in kept)]
    factors = {j: abs(units[j][1]) for j in kept}

    def row(one: Measured) -> list[str]:
        sizes = [f"{factor * one.before[j]:.4g}, {factor * one.after[j]:.3g}" for j, factor in factors.items()]
        return [*(f"{value:.4g}" for value in one.values.values()), _share(one, found), *sizes]

    rows = [row(one) for one in shown]
    if not found.nominal.values:
        head, rows = ["place", *head], [["nominal", *row] for row in rows]
    few = f" (the worst {_MOST_POINTS} of {len(ranked)})" if len(ranked) > _MOST_POINTS else ""
    return Table(f"Points simulated{few}: half peak-to-peak values", head, rows)


def _largest(found: Verification, j: int) -> float:
    """The largest share that an output keeps."""
    return max((one.after[j] / one.before[j] for one in found.points if one.before[j] > 0.0), default=-math.inf)


def _share(one: Measured, found: Verification) -> str:
    return percent(one.share) + (" (nominal)" if one is found.nominal else "")


def _how(tuning: Tuning, found: Verification) -> str:
    command, unit = tuning.command, f" {tuning.input_unit}" if tuning.input_unit else ""
    if isinstance(command, MoveCommand):
        return (
            f"The move over {command.move.distance:.5g} was simulated from {command.start:.4g} s on. Half the peak-to-peak values "
            "of the outputs after its end are compared with those after an abrupt move, scaled to the distance: what a step "
            f"of the position would leave. The communication step was {found.step:.3g} s. Pictures show it beside the "
            "fastest move within the limits."
        )
    why = f" ({command.width:.4g} s between changes, which leaves a rigid body at rest)" if command.integrators else ""
    text = (
        f"A {command.name} of {command.amplitude:.5g}{unit} from {command.rest:.5g}{unit} at {command.start:.4g} s{why} was "
        "simulated with and without the shaper. "
        "Half the peak-to-peak values of the outputs after the last change of the command are compared; the share is that of the "
        f"worst output. The communication step was {found.step:.3g} s."
    )
    if len(found.outputs) > 3:
        text += f" Of {len(found.outputs)} outputs the table shows the three that keep most."
    left = [name for name in tuning.outputs if name not in found.outputs]
    return f"{text} Not compared, since they do not come to rest: {', '.join(left)}." if left else text


def effort_blocks(tuning: Tuning) -> list[Block]:
    """Steps and runs of the plant, and the time, of each part of the work."""
    if not tuning.efforts:
        return []
    whole = sum(tuning.efforts.values(), Effort())
    rows = [
        [name, f"{one.steps}", f"{one.runs}", f"{one.seconds:.3g}", f"{one.stepping:.3g}"]
        for name, one in (*tuning.efforts.items(), ("all", whole))
    ]
    head = ["part", "steps of the plant", "runs", "time [s]", "of it in steps [s]"]
    return [Table("Steps of the plant, and time", head, rows)]

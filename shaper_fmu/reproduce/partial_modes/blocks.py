"""Figures and tables for Jung (2011)."""

from __future__ import annotations

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.modes import set_name
from shaper_fmu.reproduce.partial_modes.runs import Case
from shaper_fmu.reproduce.partial_modes.study import TOLERANCES, Found, Study

_LABELS = {
    "none": "no shaper",
    "fast": "9.42 rad/s only (mode 2 as printed)",
    "slow": "3.85 rad/s only (mode 1 as printed)",
    "both": "both modes",
}
_END = 12.0


def blocks(study: Study) -> list[Block]:
    """All of the page after the claims, in the paper's order, then the closed loop's modes."""
    shown, printed = study.found[-1], study.default.printed
    return [
        Text(
            "The paper prints neither masses, springs nor gains. "
            + " ".join(f"Set {found.machine.name}: {found.machine.described()}." for found in study.found)
            + f" Figures 4 to 7 are those of set {shown.machine.name}, with which nearly all of the paper's statements hold."
        ),
        _unshaped(shown),
        *(_compared(shown, j) for j in range(3)),
        *(_staircase(f"fig{8 + i}", i, printed[name]) for i, name in enumerate(("slow", "fast", "both"))),
        *(table for found in study.found for table in _tables(found)),
        Text(
            "The shaper stands outside the loop, so what swings are the closed loop's modes, with set A "
            + ", ".join(f"{w:.4f}" for w in study.response.natural_frequency)
            + " rad/s. Shaping these, and of these only those that the tolerance needs, is the cure."
        ),
        _sets_table(study),
        _choices_table(study),
        _cure(study),
    ]


def _unshaped(found: Found) -> Figure:
    time, positions = found.cases["none"].thinned()
    seen = time <= _END
    lines = [Line(f"x{j + 1}", time[seen], positions[j][seen]) for j in range(3)]
    return Figure("fig4", "Fig. 4: the controller alone", "time [s]", "position [m]", lines)


def _tables(found: Found) -> list[Table]:
    name = f"Set {found.machine.name}"
    return [
        _cases_table(f"{name}: shapers for the open loop's modes, exact", found.cases),
        _cases_table(f"{name}: shapers for the open loop's modes, rounded as printed in eq. (11)", found.printed),
        _cases_table(f"{name}: the same for an S-shaped move of 1 s (cycloid)", found.s_shaped),
    ]


def _compared(found: Found, j: int) -> Figure:
    lines = []
    for i, name in enumerate(("slow", "fast", "both", "none")):
        time, positions = found.cases[name].thinned()
        seen = time <= _END
        lines.append(Line(_LABELS[name], time[seen], positions[j][seen], style=i))
    return Figure(f"fig{5 + j}", f"Fig. {5 + j}: x{j + 1} by the modes considered", "time [s]", f"x{j + 1} [m]", lines)


def _staircase(key: str, number: int, case: Case) -> Figure:
    what = ("the mode printed as first, 3.85 rad/s", "the mode printed as second, 9.42 rad/s", "both modes")[number]
    times, levels = zip(*case.steps, strict=True)
    x = np.repeat([0.0, *times, 3.0], 2)[1:-1]
    line = Line("shaped step", x, np.repeat([0.0, *levels], 2))
    title = f"Fig. {8 + number}: a step shaped for {what}; the last one at {times[-1]:.3f} s"
    return Figure(key, title, "time [s]", "command [m]", [line])


def _shown(values: np.ndarray, digits: int) -> str:
    return " / ".join(f"{x:.{digits}f}" for x in values)


def _cases_table(title: str, cases: dict[str, Case]) -> Table:
    rows = [
        [
            _LABELS[name], f"{c.duration:.4f}", _shown(c.overshoot, 3), _shown(c.rise, 3), _shown(c.enveloped5, 3),
            _shown(c.settled5, 3), _shown(c.settled2, 3),
        ]
        for name, c in cases.items()
    ]  # fmt: skip
    head = ["shaped", "last impulse [s]", "overshoot x1/x2/x3 [%]", "90 % after [s]", "envelope within 5 % [s]"]
    return Table(title, [*head, "settled to 5 % [s]", "settled to 2 % [s]"], rows)


def left_after(case: Case) -> float:
    """The residual rho of a run: the largest deviation of any mass from the last impulse on."""
    return float(np.abs(case.positions[:, case.time >= case.duration - 1e-9] - 1.0).max())


def _sets_table(found: Study) -> Table:
    rows = []
    for one in found.sets:
        run = found.cure[one.modes]
        times = [found.response.settling_time(one.shaper, band).max() for band in (0.05, 0.02)]
        rows.append([
            set_name(one), f"{one.duration:.5f}", f"{one.residual:.6f}", f"{left_after(run):.6f}",
            *(f"{t:.4f}" for t in times), f"{run.settled5.max():.4f}", f"{run.settled2.max():.4f}",
        ])  # fmt: skip
    head = ["modes", "D [s]", "rho", "rho, FMUs", "to 5 % [s]", "to 2 % [s]", "to 5 %, FMUs", "to 2 %, FMUs"]
    return Table("ZVD on the closed loop's modes (0 is the slowest): all sets", head, rows)


def _choices_table(found: Study) -> Table:
    rows = []
    for (kind, tolerance), selection in found.chosen.items():
        one = selection.chosen
        shorter = 1.0 - one.duration / selection.full.duration
        rows.append([f"{kind}, {tolerance:.0%}", set_name(one), f"{one.duration:.5f}", f"{shorter:.1%}", f"{one.residual:.6f}"])
    return Table("Chosen sets", ["shaper, tolerance", "modes", "D [s]", "shorter than all modes by", "rho"], rows)


def _cure(found: Study) -> Figure:
    chosen = found.chosen["zvd", TOLERANCES[1]].chosen
    every = found.sets[-1]
    shown = {
        "no shaper": found.default.cases["none"],
        "both open-loop modes (the paper)": found.default.cases["both"],
        f"closed-loop modes {set_name(chosen)}, chosen for 5 %": found.cure[chosen.modes],
        "all closed-loop modes": found.cure[every.modes],
    }
    lines = []
    for name, case in shown.items():
        time, positions = case.thinned()
        seen = time <= _END
        lines.append(Line(name, time[seen], positions[2][seen]))
    levels = [(0.95, "-5 %"), (1.05, "+5 %")]
    return Figure("cure", "x3 of set A with shapers for the closed loop's modes", "time [s]", "x3 [m]", lines, levels)

"""Figures and tables for Taskin, Kilic and Kapucu (2019)."""

from __future__ import annotations

import numpy as np

from shaper_fmu.master.results import Results
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.reproduce.pwm.phases import PHASE
from shaper_fmu.reproduce.pwm.runs import (
    CASES,
    DAMPING_RATIO,
    HALF_PERIOD,
    LONG_CASE,
    SHORT,
    SHORT_CASE,
    STEP,
    ZV_CASE,
    switch_times,
)
from shaper_fmu.reproduce.pwm.study import DAMPINGS, FREQUENCIES, GRID_STEPS, LEVEL, STAIRCASE, Study

_SHOWN = (5.0, 9.0, 11.0, 12.0, 13.0, 15.0, 20.0, 25.0)
_LIMIT = [(LEVEL, f"{LEVEL:g} %")]


def blocks(found: Study) -> list[Block]:
    """All of the page after the claims, in the paper's order."""
    return [
        _any_curve(found),
        _response(
            "fig2",
            "Fig. 2: the reference motion profile, carrier and pulses, ratio 9",
            found.responses[LONG_CASE, 9.0],
            HALF_PERIOD,
        ),
        _response("fig3", "Fig. 3: ZV staircase, carrier and pulses, ratio 9", found.responses[ZV_CASE, 9.0], HALF_PERIOD),
        _response("fig4", "Fig. 4: travel time 0.1374 s, ratio 12", found.responses[LONG_CASE, 12.0], HALF_PERIOD),
        _response("fig5", "Fig. 5: travel time 0.1222 s, ratio 12", found.responses[SHORT_CASE, 12.0], SHORT),
        _edges(found),
        _residuals("fig6", "Fig. 6: residual vibration, travel time 0.1374 s", found, (LONG_CASE, ZV_CASE)),
        _residuals("fig7", "Fig. 7: residual vibration, travel time 0.1222 s", found, (SHORT_CASE,)),
        _table(found),
        _widths(found),
        *_robustness(found),
        _designs(found),
        _grid(found),
        _agreement(found),
    ]


def _any_curve(found: Study) -> Figure:
    run, carrier = found.s_curve, found.responses[ZV_CASE, 9.0]
    during = carrier.time <= HALF_PERIOD
    lines = [
        Line("S-curve", run.time, run["profile.position"], style=1),
        Line("triangle carrier", carrier.time[during], carrier["train.carrier"][during], style=3),
        Line("pulses", run.time, run["modulator.pulse"], style=4),
    ]
    title = "Fig. 1: any S-curve, here a cycloid, carrier and pulses, ratio 9"
    return Figure("fig1", title, "time [s]", "command", lines, marks=[(HALF_PERIOD, "travel time")])


def _response(key: str, title: str, results: Results, travel: float) -> Figure:
    names = {"train.reference": ("reference", 1), "train.carrier": ("triangle carrier", 3), "train.pulse": ("pulses", 4)}
    if results.time[-1] > 1.5 * travel:
        names = {"plant.position": ("position of the mass [m]", 0), **names}
    lines = []
    for name, (label, style) in names.items():
        until = results.time <= (travel if name == "train.carrier" else results.time[-1])
        lines.append(Line(label, results.time[until], results[name][until], style=style))
    return Figure(key, title, "time [s]", "command, position", lines, marks=[(travel, "travel time")])


def _residuals(key: str, title: str, found: Study, cases: tuple[str, ...]) -> Figure:
    lines = []
    for i, case in enumerate(cases):
        dense, whole = found.dense[case], found.whole[case]
        lines.append(Line(case, dense.ratio, dense.relative, style=i))
        lines.append(Line(f"{case}, whole ratios", whole.ratio, whole.relative, style=i + 4, joined=False))
    marks = [(found.crossing[case], f"{case}: {found.crossing[case]:.2f}") for case in cases]
    return Figure(key, title, "frequency ratio", "residual vibration [% of a step's]", lines, _LIMIT, marks)


def _edges(found: Study) -> Table:
    rows = [
        [case, ", ".join(f"{1e3 * t:.3f}" for t in switch_times(found.responses[case, 12.0]))] for case in (LONG_CASE, SHORT_CASE)
    ]
    return Table("Switches at ratio 12, from the time responses [ms]", ["command", "switches"], rows, left_aligned=True)


def _table(found: Study) -> Table:
    rows = [[case, *(f"{s.relative[s.at(q)]:.3f}" for q in _SHOWN), f"{found.first[case]:g}"] for case, s in found.whole.items()]
    rows += [
        [f"{case}, phase {PHASE:g}", *(f"{values[round(q) - 1]:.3f}" for q in _SHOWN), f"{found.first_shifted[case]:g}"]
        for case, values in found.shifted.items()
    ]
    title = "Residual vibration over the frequency ratio, also with a carrier of another phase [% of a step's at the same time]"
    return Table(title, ["", *(f"{q:g}" for q in _SHOWN), "below 5 % from"], rows)


def _widths(found: Study) -> Table:
    rows = []
    for case, s in found.whole.items():
        rows.append([f"{case}: pulses", *(f"{s.pulses[s.at(q)]:.0f}" for q in _SHOWN), ""])
        shortest = f"{1e3 * s.width.min():.4f} at {s.ratio[s.width.argmin()]:g}"
        rows.append([f"{case}: shortest [ms]", *(f"{1e3 * s.width[s.at(q)]:.3f}" for q in _SHOWN), shortest])
    return Table("Pulses, and the shortest pulse or gap", ["", *(f"{q:g}" for q in _SHOWN), "least of 1 to 25"], rows)


def _robustness(found: Study) -> list[Block]:
    shown = [f"{LONG_CASE}, ratio 12", f"{SHORT_CASE}, ratio 13", STAIRCASE, "minimax, 0.1374 s", "UM-ZVD"]
    by_frequency = [Line(n, FREQUENCIES, found.robust[n].frequency, style=i) for i, n in enumerate(shown)]
    by_damping = [Line(n, DAMPINGS, found.robust[n].damping, style=i) for i, n in enumerate(shown)]
    rows = []
    for name, one in found.robust.items():
        low, high = one.band
        ends = f"{one.damping[0]:.2f}, {one.damping[-1]:.2f}"
        rows.append(
            [name, f"{np.interp(1.0, FREQUENCIES, one.frequency):.3f}", f"{low:.4f} .. {high:.4f}", f"{high - low:.4f}", ends]
        )
    head = ["command", "nominal V [%]", "V < 5 %, w/wn", "width", f"V [%] at damping 0, {2 * DAMPING_RATIO:g}"]
    axis = "V [% of a step's at the start]"
    return [
        Figure("robustness", "Wrong natural frequency", "natural frequency over the designed one", axis, by_frequency, _LIMIT),
        Figure("damping", "Wrong damping ratio", "damping ratio", axis, by_damping, _LIMIT, [(DAMPING_RATIO, "designed")]),
        Table("Robustness", head, rows),
    ]


def _designs(found: Study) -> Table:
    rows = [[name, f"{1e3 * travel:.1f}", *(f"{v:.2f}" for v in values)] for name, (travel, values) in found.designs.items()]
    head = ["design", "travel [ms]", "0.8", "0.9", "1", "1.1", "1.2"]
    return Table("Other on/off commands: V [%] over the natural frequency by the designed one", head, rows)


def _grid(found: Study) -> Table:
    rows = []
    for case in CASES:
        exact = found.whole[case]
        i, above = exact.at(12.0), exact.ratio >= 12.0
        rows.append([case, "ends at events", f"{1e3 * STEP:g}", f"{exact.relative[i]:.3f}", f"{exact.relative[above].max():.3f}"])
        for output, label in {"pulse": "held", "pulse_mean": "held, mean of the step"}.items():
            for step in GRID_STEPS:
                s = found.grid[output][case, step]
                rows.append([case, label, f"{1e3 * step:g}", f"{s.relative[i]:.3f}", f"{s.relative[above].max():.3f}"])
    head = ["command", "pulses", "step [ms]", "ratio 12", "worst whole ratio from 12 on"]
    return Table("What steps cost that do not end at the pulses [% of a step's]", head, rows)


def _agreement(found: Study) -> Text:
    worst = max(float(np.abs(s.vibration - s.designed).max()) for s in found.dense.values())
    runs = sum(len(s.ratio) for s in found.dense.values())
    return Text(
        f"Of the {runs} runs of figs. 6 and 7, V from the plant's state after the command and V by the pulse train's own design "
        f"formula differ by {worst:.1e} % at most."
    )

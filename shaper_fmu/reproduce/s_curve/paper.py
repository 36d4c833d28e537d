"""Ozokutan, Karadag, Kapucu and Kutuk 2025: a smooth S-curve for an undamped beam on a moving base.

Figures 2 and 3 and the claims of the text, through the FMUs MotionProfile, InputShaper and FlexibleBeam; then what the paper
leaves for later: several modes, and damping.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line, Panels
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Reproduction
from shaper_fmu.reproduce.s_curve.claims import SPEED_LIMIT, THRESHOLD, claims, first_mode
from shaper_fmu.reproduce.s_curve.study import COMMANDS, DAMPING, DURATIONS, EXAMPLE, GRID, RATIOS, Study, possible, run_study

PAPER = (
    "A. Ozokutan, A. E. Karadag, S. Kapucu, M. E. Kutuk: Residual Vibration Suppression in Flexible Undamped Base-Excited "
    "Translational Systems Using a Smooth S-Curve Motion Profile, 2025 (in Turkish)"
)


def reproduce(update: Update) -> Reproduction:
    """Run the study; `update(done, total)` is called after each part."""
    study = run_study(update)
    blocks = [_notes(), *_profile_figures(study), _durations(study), _responses(study), *_scans(study), *_future(study)]
    return Reproduction("s-curve", "Smooth S-curve for a flexible beam, run again", PAPER, claims(study), blocks)


def _notes() -> Block:
    return Text(
        "The moves cover 0.1 m; the paper does not give its distance, and all but the speeds is proportional to it. Residuals "
        "are amplitudes in a mode after the move, over those that a step of the same distance would leave. Misprints that were "
        "read otherwise: the tip mass acts in eq. (1) with the sign that it has in eq. (8), and eq. (14) needs t3 and t4 in its "
        "last two lines."
    )


def _durations(study: Study) -> Block:
    rows = [
        [
            f"{r:g}",
            f"{100 * study.polynomial[r].relative[0]:.3f}",
            f"{100 * study.nominal[r].relative[0]:.1e}",
            f"{100 * study.stiffer[r].relative[0]:.3f}",
            f"{study.cruise[r]:.4f}",
            f"{study.nominal[r].velocity:.4f}",
            f"{study.nominal[r].acceleration:.4g}",
        ]
        for r in DURATIONS
    ]
    head = ["T / Tn", "3-4-5, %", "S-curve, %", "S-curve, wn + 5 %, %", "A tau, m/s", "peak speed, m/s", "peak acceleration, m/s2"]
    return Table("Residual vibration in the first mode, and what the S-curve takes (0.1 m)", head, rows)


def _profile_figures(study: Study) -> list[Block]:
    run, (distance, duration, speed) = study.example, EXAMPLE
    names = {"acceleration": "profile.acceleration", "velocity": "profile.velocity", "position": "profile.position"}
    lines = [Line(f"{name}, over its peak", run.time, run[v] / np.max(run[v])) for name, v in names.items()]
    tau = 0.5 * (duration - distance / speed)
    ends = (tau, 2.0 * tau, duration - 2.0 * tau, duration - tau)
    title = f"Fig. 2: the S-curve with a cruise, {distance:g} m in {duration:g} s at {speed:g} m/s"
    return [Figure("fig2", title, "time [s]", "share", lines, marks=[(t, f"t{i + 1}") for i, t in enumerate(ends)])]


def _responses(study: Study) -> Panels:
    """Figure 3: positions of base and tip."""
    titles = {"s_curve": "S-curve", "polynomial_345": "3-4-5 polynomial"}
    places = {"base": "beam.base_position", "tip": "beam.tip_position"}
    letters = iter("abcd")
    panels = []
    for profile, title in titles.items():
        for place, variable in places.items():
            lines = [
                Line(f"{r:g} Tn", study.shown[profile, r].time, 1e3 * study.shown[profile, r][variable], style=i)
                for i, r in enumerate(DURATIONS)
            ]
            heading = f"({next(letters)}) {title}, {place}"
            panels.append(Figure(f"fig3{heading[1]}", heading, "time [s]", "position [mm]", lines))
    return Panels("fig3", "Fig. 3: positions of the base and the tip", panels)


def _scans(study: Study) -> list[Block]:
    residuals = [Line(name, GRID, 100 * first_mode(moves), style=i) for i, (name, moves) in enumerate(study.scans.items())]
    fast = (GRID >= 0.6) & (GRID <= 2.5)
    peak = np.array([move.velocity for move in study.scans["S-curve"]])
    polynomial = np.array([move.velocity for move in study.scans["3-4-5 polynomial"]])
    speeds = [
        Line("S-curve", GRID[fast], peak[fast]),
        Line("S-curve, A tau", GRID[fast], 0.2 / (GRID[fast] * study.period)),
        Line("3-4-5 polynomial", GRID[fast], polynomial[fast]),
    ]
    detuned = [Line(f"{r:g} Tn", RATIOS, 100 * study.detuned[r], style=i) for i, r in enumerate(DURATIONS)]
    threshold = [(100 * THRESHOLD, "5 %")]
    return [
        Figure("residual", "Residual in the first mode", "duration T / Tn", "share of a step's [%]", residuals, threshold),
        Figure("speed", "Peak speed over 0.1 m", "duration T / Tn", "speed [m/s]", speeds, [(SPEED_LIMIT, "the paper's actuator")]),
        Figure(
            "detuned",
            "The S-curve on beams of another frequency",
            "actual / designed wn",
            "share of a step's [%]",
            detuned,
            threshold,
        ),
    ]


def _future(study: Study) -> list[Block]:
    lines = [
        Line(name, grid, 100 * np.array([move.modes[1] for move in moves]), style=i)
        for i, (name, (grid, moves)) in enumerate(study.mode_scans.items())
    ]
    rows = []
    for name in COMMANDS:
        for r in DURATIONS:
            if possible(name, r):
                cells = [_cell(study.modes[name, zeta, r].modes[j]) for zeta in DAMPING for j in range(3)]
                rows.append([name, f"{r:g}", *cells])
    head = ["command", "T / Tn", *(f"{zeta:.0%} damping: mode {j}" for zeta in DAMPING for j in (1, 2, 3))]
    second = {name: {r: study.modes[name, 0.0, r].modes[1] for r in DURATIONS} for name in ("S-curve", "3-4-5 polynomial, ZV")}
    better = [r for r in DURATIONS if second["3-4-5 polynomial, ZV"][r] < second["S-curve"][r]]
    worse = [r for r in DURATIONS if r not in better]
    damped = {zeta: study.modes["S-curve", zeta, 0.8].modes[0] for zeta in DAMPING}
    return [
        Text(
            "What the paper leaves for later: several modes, and damping. The table and the figure give the residual amplitude of "
            "the tip in each mode at the end of the command, a shaper's time included, in % of the distance; 0 stands for less "
            "than 0.001 %, which the master's steps may cost. All commands know the first mode alone, and take it for undamped "
            "unless they are told. In the undamped second mode the ZV-shaped polynomial leaves less than the S-curve at "
            f"{', '.join(f'{r:g}' for r in better)} periods, and the S-curve less at {', '.join(f'{r:g}' for r in worse)}. "
            f"Damping that it does not know of costs the S-curve more than all higher modes: {_cell(damped[0.01])} % and "
            f"{_cell(damped[0.02])} % of the distance at 0.8 periods, with 1 % and 2 % of damping. Told of it, it leaves nothing "
            "in the first mode."
        ),
        Table("Several modes, and damping: residual at the tip, % of the distance", head, rows),
        Figure(
            "second_mode",
            "Undamped second mode after commands for the first",
            "duration T / Tn",
            "residual at the tip [% of the distance]",
            lines,
        ),
    ]


def _cell(share: float) -> str:
    """A share in %, or "0" where it is no more than the master's own error."""
    return "0" if share < 1e-5 else f"{100 * share:.2g}"

"""Kilic and Kapucu 2011: a command in two parts for a pendulum on a hydraulic arm.

Figures 2 to 6 and the claims of the text, through the FMUs MotionProfile, InputShaper, MassSpringDamper, OverheadCrane and
HydraulicPendulum; then what the paper leaves for later: errors in the damping.
"""

from __future__ import annotations

import numpy as np

from shaper_fmu.master.results import Results
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Reproduction
from shaper_fmu.reproduce.two_part.claims import band_text, claims
from shaper_fmu.reproduce.two_part.robustness import PLANT, compared_table, damping_blocks
from shaper_fmu.reproduce.two_part.runs import COMMANDS, DAMPING_RATIO, DISTANCE, DURATION, NATURAL_FREQUENCY, START
from shaper_fmu.reproduce.two_part.study import (
    ARM_RATIOS,
    ERRORS,
    LEVEL,
    RATIOS,
    Estimates,
    Study,
    run_study,
)

PAPER = "A. Kilic, S. Kapucu: A New Robust Method for Reducing Residual Vibrations in Flexible Systems, 2011 (in Turkish)"
ESTIMATE = "estimated over actual frequency, w*/w"
_LEVELS = [(100 * LEVEL, "5 %")]
_MARKS = [(1.0, "designed")]


def reproduce(update: Update) -> Reproduction:
    """Run the study; `update(done, total)` is called after each part."""
    study = run_study(update)
    blocks = [_notes(), *_motions(study), _table(study), *_curves(study), compared_table(study), *damping_blocks(study)]
    return Reproduction("two-part", "Two-part command for a pendulum on a hydraulic arm, run again", PAPER, claims(study), blocks)


def _notes() -> Block:
    return Text(
        f"The pendulum has wn = {NATURAL_FREQUENCY} rad/s and a damping ratio of {DAMPING_RATIO}, the move covers {DISTANCE} m in "
        f"{DURATION} s. V is the envelope of the residual vibration at the command's end over that of a step at its start. It is "
        "given for "
        "an oscillator (linear), for a nonlinear pendulum whose hinge makes the motion exactly, and for the whole hydraulic arm "
        "with "
        "servo valve, cylinder, slide and rod, whose hydraulic parameters the paper does not give and we chose."
    )


def _motions(study: Study) -> list[Block]:
    names = {"single": "(a) reference input", "two-part": "(b) proposed input, in two parts"}
    shapes = [Line(names[name], _time(run), run["profile.position"] / DISTANCE) for name, run in study.shapes.items()]
    swings = []
    for i, (name, run) in enumerate(study.arm_runs.items()):
        exact = study.swings[name].run
        swings += [
            Line(f"hydraulic arm, {name}", _time(run), run["arm.swing_angle"], style=2 * i),
            Line(f"exact drive, {name}", _time(exact), exact["crane.swing_angle"], style=2 * i + 1),
        ]
    pressures = [
        Line(f"{side}, {name}", _time(run), run[f"arm.pressure[{k + 1}]"] / 1e5, style=2 * i + k)
        for i, (name, run) in enumerate(study.arm_runs.items())
        for k, side in enumerate(("piston side", "rod side"))
    ]
    return [
        Figure("fig2", "Fig. 2: the reference input and the proposed one", "time [s]", "share of the distance", shapes),
        _response("fig3", "Fig. 3: the cylinder and the pendulum, reference input", study.arm_runs["single"]),
        _response("fig4", "Fig. 4: the cylinder and the pendulum, proposed input", study.arm_runs["two-part"]),
        Figure("swing", "Swing on the hydraulic arm and with an exact drive", "time [s]", "angle [rad]", swings),
        Figure("pressure", "Hydraulic arm: pressures in the cylinder", "time [s]", "pressure [bar]", pressures),
    ]


def _response(key: str, title: str, run: Results) -> Figure:
    time = _time(run)
    lines = [
        Line("input", time, run["profile.position"] / DISTANCE),
        Line("hydraulic cylinder", time, run["arm.slide_position"] / DISTANCE),
        Line("pendulum", time, run["arm.swing_angle"], right=True),
    ]
    return Figure(key, title, "time [s]", "share of the distance", lines, right_label="swing [rad]")


def _time(run: Results) -> np.ndarray:
    """Time since the start of the move [s]."""
    return run.time - START


def _table(study: Study) -> Block:
    rows = []
    for name in COMMANDS:
        swing, arm = study.swings[name], study.arm[name]
        shape = study.shapes[name].metrics
        rows += [
            [f"{name}, linear", _percent(study.nominal[name]), band_text(study.bands[name]), "", "", f"{shape['velocity']:.4f}"],
            [
                f"{name}, exact drive",
                _percent(swing.vibration),
                band_text(swing.band),
                f"{swing.peak:.4f}",
                f"{swing.residual:.3g}",
                "",
            ],
            [
                f"{name}, hydraulic arm",
                _percent(arm.vibration),
                band_text(study.arm_bands[name]),
                f"{arm.peaks['arm.swing_angle']:.4f}",
                f"{arm.envelope:.3g}",
                f"{arm.peaks['arm.slide_velocity']:.4f}",
            ],
        ]
    head = ["plant", "V, %", "V below 5 %: wn over designed", "peak swing, rad", "residual swing, rad", "peak speed, m/s"]
    return Table("Linear, nonlinear, hydraulic", head, rows)


def _percent(value: float) -> str:
    return "0" if value < 1e-5 else f"{100.0 * value:.3f}"


def _curves(study: Study) -> list[Block]:
    inside = (ARM_RATIOS[0] - 1e-9 <= RATIOS) & (ARM_RATIOS[-1] + 1e-9 >= RATIOS)
    by_estimate = [Line(name, RATIOS, 100 * one.curve, style=i) for i, (name, one) in enumerate(study.estimates.items())]
    by_plant = [Line(name, RATIOS, 100 * curve, style=i) for i, (name, curve) in enumerate(study.curves.items())]
    arms = []
    for i, name in enumerate(COMMANDS):
        arms += [
            Line(f"{name}, oscillator", RATIOS[inside], 100 * study.curves[name][inside], style=2 * i),
            Line(f"{name}, hydraulic arm", ARM_RATIOS, 100 * study.arm_curves[name], markers=True, style=2 * i + 1),
        ]
    return [
        _amplitude("fig5", "Fig. 5: robustness of the reference input", study.estimates["single"]),
        _amplitude("fig6", "Fig. 6: robustness of the proposed input", study.estimates["two-part"]),
        Text(
            "Figures 5 and 6 are over the estimate w* of eq. (7): the command is designed for w*, the pendulum has its own "
            "frequency w. A robustness curve of a shaper is usually over the plant's frequency instead: the command stays, the "
            "pendulum changes. Both follow; they are no mirror images, since the time of the move is fixed."
        ),
        Figure("estimate", "V over the estimate", ESTIMATE, "V [%]", by_estimate, _LEVELS, [(1.0, "right estimate")]),
        Figure("robustness", "V over the pendulum's frequency, with shaped steps", PLANT, "V [%]", by_plant, _LEVELS, _MARKS),
        _errors_table(study),
        Figure("arm_robustness", "V on the hydraulic arm, by the rod's length", PLANT, "V [%]", arms, _LEVELS, _MARKS),
    ]


def _amplitude(key: str, title: str, one: Estimates) -> Figure:
    inside = (ARM_RATIOS[0] - 1e-9 <= RATIOS) & (ARM_RATIOS[-1] + 1e-9 >= RATIOS)
    lines = [
        Line("hydraulic arm", ARM_RATIOS, one.arm, markers=True),
        Line("linear pendulum", RATIOS[inside], one.amplitude[inside]),
    ]
    return Figure(key, title, ESTIMATE, "amplitude of the pendulum [rad]", lines, marks=[(1.0, "right estimate")])


def _errors_table(study: Study) -> Table:
    rows = []
    for name in COMMANDS:
        one = study.estimates[name]
        for what, values, ends in (
            ("estimate wrong, same time", one.errors, one.band),
            ("estimate wrong, time in its periods", one.in_periods, one.in_periods_band),
            ("pendulum changed", study.errors[name], study.bands[name]),
        ):
            rows.append([f"{name}: {what}", *(f"{100 * v:.3f}" for v in values), band_text(ends)])
    head = ["command", *(f"{r:g}" for r in ERRORS), "V below 5 %"]
    return Table("V [%] over w*/w of a wrong estimate, or over actual by designed frequency of a changed pendulum", head, rows)

"""Tables of a tuning's modes: their uncertainties, their ranges, and other poles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shaper_fmu.analysis.identification import Mode
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.report.tune.evidence import POLYNOMIAL, Evidence
from shaper_fmu.tune.choice.boxes import UNDAMPED, shares
from shaper_fmu.tune.identify.experiment import PlantIdentification
from shaper_fmu.tune.identify.range import ModeRange
from shaper_fmu.tune.tuning import Tuning

_MOST_POINTS = 40
_NOTHING = 1e-5
"""Smaller shares are shown as less than this one."""


def mode_blocks(tuning: Tuning, found: Evidence) -> list[Block]:
    """The modes, the operating points, other poles, the experiment, and the findings."""
    blocks: list[Block] = [modes_table(tuning, found)] if found.found.modes else [Text("There is no mode of vibration.")]
    if found.found.others:
        blocks.append(_others_table(found))
    if tuning.plant is not None:
        if len(tuning.plant.experiments) > 1:
            blocks.append(_points_table(tuning, tuning.plant.experiments, tuning.plant.ranges))
        blocks.append(_experiment_table(tuning.plant.nominal))
    if tuning.findings:
        blocks.append(
            Table("Findings", ["code", "what was found"], [[one.code, one.text] for one in tuning.findings], left_aligned=True)
        )
    return blocks


def modes_table(tuning: Tuning, found: Evidence) -> Table:
    """Frequency, damping, deviations, ranges and shares of the modes."""
    modes = found.found.modes
    parts = shares(tuning.choice.boxes).max(axis=1) if tuning.choice is not None else [mode.share for mode in modes]
    ranges = tuning.plant.ranges if tuning.plant is not None and len(tuning.plant.experiments) > 1 else ()
    of_step = tuning.plant is not None and tuning.choice is not None
    head = ["mode", "natural frequency [rad/s]", "[Hz]", "damping ratio", *(["over the operating points"] if ranges else [])]
    rows = []
    for k, mode in enumerate(modes):
        w = mode.natural_frequency
        over = [_over(ranges[k])] if ranges else []
        frequency = with_deviation(w, mode.natural_frequency_std)
        rows.append([str(k + 1), frequency, f"{w / (2.0 * math.pi):.4g}", damping(mode), *over, percent(float(parts[k]))])
    title = "Modes, with standard deviations" + (" at the nominal point" if ranges else "")
    return Table(title, [*head, "largest share of a step's response" if of_step else "largest share of the response"], rows)


def percent(share: float) -> str:
    """A share in percent."""
    return f"less than {100.0 * _NOTHING:g} %" if 0.0 < share < _NOTHING else f"{100.0 * share:.3g} %"


def with_deviation(value: float, deviation: float) -> str:
    """A value with its standard deviation, to two digits of it; with four digits where the deviation is much less than these."""
    if not 0.0 < deviation < math.inf:
        return f"{value:.4g}"
    if deviation < 1e-4 * abs(value):
        return f"{value:.4g} ± {deviation:.0e}"
    digits = max(0, 1 - math.floor(math.log10(deviation)))
    return f"{value:.{digits}f} ± {deviation:.{digits}f}" if digits < 6 else f"{value:.4g} ± {deviation:.1e}"


def damping(mode: Mode) -> str:
    """Damping ratio and its standard deviation; 0 where it is nothing but rounding."""
    if max(mode.damping_ratio, mode.damping_ratio_std) <= UNDAMPED:
        return "0"
    return with_deviation(mode.damping_ratio, mode.damping_ratio_std)


def span(low: float, high: float, digits: int) -> str:
    """A range, or one number where both ends look the same."""
    first, last = f"{low:.{digits}g}", f"{high:.{digits}g}"
    return first if first == last else f"{first} to {last}"


def both_units(low: float, high: float) -> str:
    """A range of natural frequencies [rad/s], in Hz, too."""
    return f"{span(low, high, 4)} rad/s ({span(low / (2.0 * math.pi), high / (2.0 * math.pi), 4)} Hz)"


def given(values: Mapping[str, Any]) -> str:
    """Values of parameters."""
    shown = (f"{name} = {value:.5g}" if isinstance(value, float) else f"{name} = {value}" for name, value in values.items())
    return ", ".join(shown) or "the plant's own start values"


def _over(found: ModeRange) -> str:
    w, zeta = found.natural_frequency, found.damping_ratio
    text = both_units(w.low, w.high)
    if zeta.high > UNDAMPED:
        text += f", {span(zeta.low, zeta.high, 3)}"
    lost = sum(one is None for one in found.modes)
    return f"{text}; not found at {lost} of {len(found.modes)}" if lost else text


def _others_table(found: Evidence) -> Table:
    rows = []
    for one in found.found.others:
        swings = f" ± {abs(one.pole.imag):.5g} j" if one.pole.imag else ""
        share = "-" if one.kind in POLYNOMIAL else percent(one.share)
        rows.append([one.kind.replace("_", " "), f"{one.pole.real:.5g}{swings}", share])
    return Table("Other poles", ["kind", "pole [rad/s]", "share"], rows)


def _points_table(tuning: Tuning, experiments: Sequence[PlantIdentification], ranges: Sequence[ModeRange]) -> Table:
    def shown(mode: Mode | None) -> str:
        if mode is None:
            return "not found"
        return f"{mode.natural_frequency:.5g}, {mode.damping_ratio if mode.damping_ratio > UNDAMPED else 0.0:.4g}"

    rows = []
    for number, one in enumerate(experiments[:_MOST_POINTS]):
        values = {tuning.system.short(name) if tuning.system is not None else name: v for name, v in one.start_values.items()}
        excited = f"{one.excitation.amplitude:.3g} {one.input_unit}".rstrip()
        rows.append([given(values), excited, *(shown(found.modes[number]) for found in ranges)])
    few = f" (the first {_MOST_POINTS} of {len(experiments)})" if len(experiments) > _MOST_POINTS else ""
    head = ["point", "amplitude", *(f"mode {k + 1} [rad/s], damping" for k in range(len(ranges)))]
    return Table(f"Operating points{few}", head, rows)


def _experiment_table(found: PlantIdentification) -> Table:
    made, unit = found.excitation, found.input_unit
    duration = found.step * (len(found.time) - 1)
    length = "" if made.kind == "step" else f", {made.width:.4g} s long"
    rows = [
        ["excitation", f"{made.kind} of {f'{made.amplitude:.4g} {unit}'.rstrip()}{length}"],
        ["about the input's value", f"{made.rest:.4g} {unit}".rstrip()],
        ["the plant rests after", f"{found.settle_time:.4g} s"],
        ["free response", f"{len(found.time)} samples, {found.step:.4g} s apart: {duration:.4g} s"],
        ["not in proportion to the amplitude", f"{found.nonlinearity:.2g} of the response"],
    ]  # fmt: skip
    if found.coupling:
        rows.append(["changed by the communication step", f"{found.coupling:.2g} of the response"])
    return Table("The nominal experiment", ["what", "value"], rows, left_aligned=True)

"""Writes a system to start from: a reference, an input shaper and the user's plant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from shaper_fmu.design.shapers import shaper as design
from shaper_fmu.errors import ModelError, ShaperFmuError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.master.alone import rounded_step
from shaper_fmu.master.fmu import Fmu, load_fmu
from shaper_fmu.master.motion import motion_order
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import TRANSFERABLE, kind_of
from shaper_fmu.ssp.export import parameter_set, write_system
from shaper_fmu.ssp.write import write_parameter_set

OUTPUTS = ("position", "velocity", "acceleration")
"""The profile's output by the order of the plant's input; an input that is no motion gets the position's number."""
PROFILE, SHAPER, PLANT = "profile", "shaper", "plant"
"""Names of the instances."""
SHAPERS = [item.name for item in Shaper if item != Shaper.custom]
_PERIODS, _REST, _STEPS = 2.0, 5.0, 200
"""How long the reference moves and the plant is watched afterwards, and the steps, in natural periods."""


@dataclass(frozen=True)
class Template:
    """The result: the file, the design, and whether the natural frequency [rad/s] was known."""

    path: Path
    natural_frequency: float
    damping_ratio: float
    known: bool
    profile_output: str
    stop_time: float


def write_template(
    plant: Path | str | Fmu,
    input_: str,
    output: str,
    path: Path | str,
    *,
    kind: str = "zv",
    natural_frequency: float | None = None,
    damping_ratio: float | None = None,
) -> Template:
    """Write an archive that connects MotionProfile and InputShaper to the plant's `input_`, with `output` as the system's output.

    What is not given of the natural frequency [rad/s] and the damping ratio is asked of the plant, if it has such a variable;
    else 2 pi rad/s and 0 are taken, which the user has to correct in resources/shaper.ssv. The folder parameter_sets/ holds the
    same run without a shaper. Raises ModelError for an input or output that the plant does not have.
    """
    fmu = plant if isinstance(plant, Fmu) else load_fmu(plant)
    check_ports(fmu, input_, output)
    asked = _asked(fmu) if natural_frequency is None else {}
    frequency = natural_frequency or asked.get("natural_frequency", 0.0)
    known = frequency > 0.0
    frequency = frequency if known else 2.0 * math.pi
    damping = damping_ratio if damping_ratio is not None else min(max(asked.get("damping_ratio", 0.0), 0.0), 0.99)
    period = 2.0 * math.pi / frequency
    system = System(Path(path).stem)
    profile_output = OUTPUTS[motion_order(fmu, input_)]
    system.add("profile", fmu_path("MotionProfile"), duration=_PERIODS * period, distance=1.0)
    system.add("shaper", fmu_path("InputShaper"), shaper=kind, natural_frequency=[frequency], damping_ratio=[damping])
    system.add("plant", fmu, {name: start for name, start in _inputs(fmu).items() if name != input_})
    system.connect(f"profile.{profile_output}", "shaper.command")
    system.connect("shaper.shaped_mean", f"plant.{input_}")
    stop_time = (_PERIODS + _REST) * period + (design(kind, frequency, damping).duration if kind != "none" else 0.0)
    step = rounded_step(period / _STEPS)
    stop_time = step * math.ceil(stop_time / step)
    unshaped = write_parameter_set(parameter_set(system, {"shaper.shaper": "none"}, "unshaped"))
    written = write_system(
        system,
        path,
        stop_time=stop_time,
        step=step,
        description=f"A reference, shaped for {frequency:.6g} rad/s, leads to {fmu.name}; look at plant.{output}.",
        more={"parameter_sets/unshaped.ssv": unshaped},
    )
    return Template(written, frequency, damping, known, profile_output, stop_time)


def check_ports(fmu: Fmu, input_: str, output: str) -> None:
    """Raise ModelError if an FMU has no such real input or output."""
    problems = []
    for name, causality in ((input_, "input"), (output, "output")):
        known = [v.name for v in fmu.variables.values() if v.causality == causality and kind_of(v) == "real"]
        if name not in known:
            problems.append(f"{fmu.name} has no {causality} {name!r} of real numbers.{nearest(name, known)}")
    if problems:
        raise ModelError(problems)


def _asked(fmu: Fmu) -> dict[str, float]:
    """The plant's own natural frequency and damping ratio, of the first mode, where it has such variables."""
    names = {}
    for name in ("natural_frequency", "damping_ratio"):
        found = next((n for n in (name, f"{name}[1]") if n in fmu.variables), None)
        if found is not None and (name != "natural_frequency" or fmu.unit_of(found) in ("rad/s", None)):
            names[name] = found
    system = System()
    system.add("plant", fmu, _inputs(fmu))
    try:
        results = system.simulate(1e-6, 1e-6, record=[f"plant.{name}" for name in names.values()])
    except ShaperFmuError:
        return {}
    return {name: float(results[f"plant.{found}"][0]) for name, found in names.items()}


def _inputs(fmu: Fmu) -> dict[str, str]:
    """The start values of the inputs that can be set."""
    inputs = [variable for variable in fmu.variables.values() if variable.causality == "input" and variable.start is not None]
    return {str(variable.name): str(variable.start) for variable in inputs if kind_of(variable) in TRANSFERABLE}

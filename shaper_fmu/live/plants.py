"""The plants of the page: which input takes the command, what is shown, and which parameters have sliders."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ArgumentError

Signal = Literal["position", "velocity", "acceleration"]
_SIGNALS: dict[str, Signal] = {"m": "position", "m/s": "velocity", "m/s2": "acceleration"}
_MOST_SLIDERS = 12
_FACTOR = 5.0
"""How far a slider goes from a start value, both ways."""


@dataclass(frozen=True)
class Slider:
    """A parameter of the plant, or an element of it, between two ends; `log` for one that is positive by nature."""

    name: str
    index: int
    label: str
    unit: str
    start: float
    low: float
    high: float
    log: bool


@dataclass(frozen=True)
class Plant:
    """A component as the page's plant.

    Attributes:
        title: how the page calls it.
        input: the variable that takes the shaped command.
        signal: what of a motion profile is the command.
        gain: the parameter by which the command is multiplied, "" for none.
        outputs: (variable, index, label, unit) of what can be shown, the first one by default.
        sliders: of its parameters.
        modes: the parameter that tells how many of its natural frequencies move, or their number.
        controller: parameters of a position controller between the command and the plant, {} for none.
        note: what a user has to know.
    """

    component: type[Component]
    title: str
    input: str
    signal: Signal
    outputs: tuple[tuple[str, int, str, str], ...]
    sliders: tuple[Slider, ...]
    gain: str = ""
    modes: str | int = 0
    controller: dict[str, float] = field(default_factory=dict)
    note: str = ""
    values: dict[str, Any] = field(default_factory=dict)

    def described(self) -> dict[str, Any]:
        """As plain data, for the page."""
        outputs = [dict(zip(("name", "index", "label", "unit"), one, strict=True)) for one in self.outputs]
        own = {name: getattr(self, name) for name in ("title", "input", "signal", "gain", "modes", "controller", "note", "values")}
        return {**own, "component": self.component.__name__, "outputs": outputs, "sliders": [vars(one) for one in self.sliders]}


def usual_plants() -> list[Plant]:
    """Mass-spring-damper, crane, beam and three masses."""
    from shaper_fmu.plants.flexible_beam import FlexibleBeam
    from shaper_fmu.plants.mass_spring_damper import MassSpringDamper
    from shaper_fmu.plants.overhead_crane import OverheadCrane
    from shaper_fmu.plants.three_mass_chain import ThreeMassChain
    from shaper_fmu.reproduce.partial_modes.machine import SET_A

    return [
        Plant(
            MassSpringDamper, "mass, spring and damper", "force", "position",
            _outputs(MassSpringDamper, "position", "velocity", "acceleration"),
            (
                Slider("stiffness", 0, "stiffness", "N/m", 100.0, 1.0, 5000.0, True),
                Slider("damping", 0, "damping", "N.s/m", 1.0, 0.0, 20.0, False),
                Slider("mass", 0, "mass", "kg", 1.0, 0.1, 10.0, True),
            ),
            gain="stiffness", modes=1,
            note="The force is the command times the stiffness, so that the mass comes to rest at the command.",
        ),
        Plant(
            OverheadCrane, "crane, nonlinear", "trolley_acceleration", "acceleration",
            _outputs(OverheadCrane, "swing_angle", "load_position", "trolley_position"),
            _sliders(OverheadCrane, "initial_rope_length", "damping_ratio"), modes=1,
            note="The command is the trolley's acceleration; a step sets it going for ever.",
        ),
        Plant(
            FlexibleBeam, "flexible beam", "base_acceleration", "acceleration",
            _outputs(FlexibleBeam, "tip_deflection", "tip_position", "base_position"),
            (
                *_sliders(FlexibleBeam, "length", "tip_mass"),
                Slider("modal_damping", 0, "damping ratio, mode 1", "", 0.0, 0.0, 0.2, False),
                Slider("modal_damping", 1, "damping ratio, mode 2", "", 0.0, 0.0, 0.2, False),
            ),
            modes="modes", values={"modes": 2},
            note="The command is the acceleration of the beam's base. Its first two modes move.",
        ),
        Plant(
            ThreeMassChain, "three masses under control", "force", "position",
            tuple(("position", i, f"position of mass {i + 1}", "m") for i in (2, 1, 0)),
            _sliders(ThreeMassChain, "mass", "stiffness", "damping"),
            controller={"proportional_gain": SET_A.proportional_gain, "derivative_gain": SET_A.derivative_gain},
            note="The command is the reference of a PD controller on mass 1 (300 N/m, 50 N s/m), which acts 8,000 times in what "
            "is shown. The loop's modes are not computed on this page.",
        ),
    ]  # fmt: skip


def plant_of(component: type[Component]) -> Plant:
    """A component of a user's: its first real input takes the command, and its real outputs can be shown.

    The input's unit tells which signal of a profile it gets: m a position, m/s a velocity, m/s2 an acceleration; any other unit
    gets the position. Raises ArgumentError for a component without a real input or output.
    """
    inputs = [v for v in component.variables.values() if v.causality == "input" and v.kind is float and v.size is None]
    outputs = [v.name for v in component.variables.values() if v.causality in ("output", "local") and v.kind is float]
    outputs = [name for name in outputs if not name.startswith("next_")]
    for what, found in (("input", inputs), ("output", outputs)):
        if not found:
            raise ArgumentError(f"{component.__name__} has no real {what}, so that it cannot be the page's plant")
    parameters = [v for v in component.variables.values() if v.causality == "parameter"]
    sliders = _sliders(component, *(v.name for v in parameters if v.kind is float))[:_MOST_SLIDERS]
    moved = {(slider.name, slider.index) for slider in sliders}
    kept = [v.name for v in parameters if any((v.name, i) not in moved for i in range(v.size or 1))]
    kept_words = f" Without a slider, at their start values: {', '.join(kept)}." if kept else ""
    known = component.variables
    given = all(name in known and known[name].causality == "calculatedParameter" for name in ("natural_frequency", "damping_ratio"))
    alike = given and known["natural_frequency"].size == known["damping_ratio"].size
    return Plant(
        component, component.__name__, inputs[0].name, _SIGNALS.get(inputs[0].unit, "position"), _outputs(component, *outputs),
        sliders, modes=(known["natural_frequency"].size or 1) if alike else 0,
        note=f"The command goes into {inputs[0].name} ({inputs[0].description}); other inputs keep their start values.{kept_words}",
    )  # fmt: skip


def _outputs(component: type[Component], *names: str) -> tuple[tuple[str, int, str, str], ...]:
    found = []
    for name in names:
        v = component.variables[name]
        labels = [v.name.replace("_", " ")] if v.size is None else [f"{v.name.replace('_', ' ')} {i + 1}" for i in range(v.size)]
        found += [(name, i, label, v.unit) for i, label in enumerate(labels)]
    return tuple(found)


def _sliders(component: type[Component], *names: str) -> tuple[Slider, ...]:
    return tuple(slider for name in names for slider in _of_parameter(component.variables[name]))


def _of_parameter(v: Variable[Any]) -> list[Slider]:
    found = []
    for i, start in enumerate(v.starts):
        label = v.name.replace("_", " ") if v.size is None else f"{v.name.replace('_', ' ')} {i + 1}"
        if not abs(start) < 1e100:  # no limit
            continue
        low, high, log = (start / _FACTOR, start * _FACTOR, True) if start > 0.0 else (0.0, 1.0, False)
        if start < 0.0:
            low, high = start * _FACTOR, -start * _FACTOR
        if v.name in ("damping_ratio", "modal_damping"):
            low, high, log = 0.0, max(0.3, 2.0 * start), False
        if v.name == "damping":
            low, high, log = 0.0, 4.0 * start if start else 10.0, False
        low = low if v.min is None else max(low, v.min)
        high = high if v.max is None else min(high, v.max if v.exclusive not in (True, "max") else math.nextafter(v.max, 0.0))
        found.append(Slider(v.name, i, label, v.unit, float(start), float(low), float(high), log))
    return found

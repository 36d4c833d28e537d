"""What the live page shows, computed in plain Python: the components, coupled as the page says that it couples them."""

from __future__ import annotations

import math
import random
from typing import Any

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.commands.position_controller import PositionController
from shaper_fmu.commands.pulse_train import PulseTrain
from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError
from shaper_fmu.live.plants import Plant

STEPS = 2000
SUBSTEPS = 4


class Source:
    """The unshaped command."""

    def __init__(self, state: dict[str, Any], plant: Plant):
        self.component: Component | None = None
        self.size, self.end, self.jumps = state["size"], 0.0, True
        self.name = "pulse"
        if state["command"] == "step":
            return
        mode = {"natural_frequency": state["frequency"][0], "damping_ratio": state["damping"][0], "duration": state["duration"]}
        if state["command"].startswith("pulses:"):
            self.component = PulseTrain(
                design=state["command"][7:], amplitude=state["size"], frequency_ratio=state["carrier"], **mode
            )
            self.component.initialize(0.0)
            self.end = self.component.travel_time
        else:
            more = {}
            if state["command"] == "s_curve_modes":
                for i, which in enumerate(("second", "third"), 1):
                    if len(state["frequency"]) > i:
                        more[f"{which}_natural_frequency"] = state["frequency"][i]
                        more[f"{which}_damping_ratio"] = state["damping"][i]
            self.component = MotionProfile(profile=state["command"], distance=state["size"], **mode, **more)
            self.component.initialize(0.0)
            self.end, self.jumps, self.name = state["duration"], False, plant.signal

    @property
    def value(self) -> float:
        return self.size if self.component is None else getattr(self.component, self.name)

    @property
    def next(self) -> float:
        return math.inf if self.component is None else self.component.next_event_time  # pyright: ignore[reportAttributeAccessIssue]

    def advance(self, t: float, h: float) -> None:
        if self.component is not None:
            self.component.do_step(t, h)


class Driven:
    """The plant, or a position controller and the plant."""

    def __init__(self, state: dict[str, Any], plant: Plant, first: float):
        self.plant, self.output = plant, plant.outputs[state["output"]]
        self.component = plant.component(**plant.values)
        for slider, value in zip(plant.sliders, state["parameters"], strict=True):
            array = plant.component.variables[slider.name].size is not None
            self.component.set(f"{slider.name}[{slider.index + 1}]" if array else slider.name, value)
        self.gain = getattr(self.component, plant.gain) if plant.gain else 1.0
        self.controller = PositionController(**plant.controller) if plant.controller else None
        if self.controller is None:
            setattr(self.component, plant.input, self.gain * first)
        else:
            self.controller.initialize(0.0)
        self.component.initialize(0.0)

    @property
    def response(self) -> float:
        value = getattr(self.component, self.output[0])
        return value[self.output[1]] if isinstance(value, list) else value

    def advance(self, t: float, h: float, command: float) -> None:
        if self.controller is None:
            setattr(self.component, self.plant.input, self.gain * command)
            self.component.do_step(t, h)
            return
        for i in range(SUBSTEPS):
            at, part = t + i * h / SUBSTEPS, h / SUBSTEPS
            self.controller.reference = command
            self.controller.position = self.component.position[0]  # pyright: ignore[reportAttributeAccessIssue]
            self.controller.velocity = self.component.velocity[0]  # pyright: ignore[reportAttributeAccessIssue]
            self.controller.do_step(at, part)
            setattr(self.component, self.plant.input, self.controller.force)
            self.component.do_step(at, part)


def shaper_of(state: dict[str, Any]) -> InputShaper:
    """The shaper, not yet started."""
    return InputShaper(
        shaper=state["shaper"], modes=len(state["frequency"]), natural_frequency=state["frequency"],
        damping_ratio=state["damping"], vibration_tolerance=state["tolerance"], **state["own"],
    )  # fmt: skip


def simulated(state: dict[str, Any], plant: Plant, stop: float, shaped: bool) -> tuple[list[float], list[float]]:
    """Command and response at the ends of the steps."""
    source, h = Source(state, plant), stop / STEPS
    shaper = shaper_of(state) if shaped else None
    if shaper is not None:
        shaper.command = source.value
        shaper.initialize(0.0)

    def command() -> float:
        return source.value if shaper is None else shaper.shaped

    driven = Driven(state, plant, command())
    commands, responses = [command()], [driven.response]
    for k in range(STEPS):
        t, end = k * h, (k + 1) * h
        if not source.jumps:
            if shaper is not None:
                shaper.do_step(t, end - t)
            driven.advance(t, end - t, source.value if shaper is None else shaper.shaped_mean)
            source.advance(t, end - t)
            if shaper is not None:
                shaper.command = source.value
        near = 1e-9 * (end - t)
        while source.jumps and t < end:
            jump = min(source.next, math.inf if shaper is None else shaper.next_event_time)
            until = jump if t < jump < end - near else end
            driven.advance(t, until - t, command())
            before = source.value
            source.advance(t, until - t)
            if shaper is not None:
                shaper.do_step(t, until - t)
                if source.value != before:
                    shaper.command = source.value
                    shaper.do_step(until, 0.0)
            t = until
        commands.append(command())
        responses.append(driven.response)
    return commands, responses


def remaining(responses: list[float], stop: float, since: float) -> float:
    """Half of the difference between the largest and the smallest value after a time."""
    h = stop / STEPS
    after = [y for k, y in enumerate(responses) if k * h >= since - 1e-12] or responses[-1:]
    return 0.5 * (max(after) - min(after))


def random_state(rng: random.Random, plants: dict[str, Plant], page: dict[str, Any]) -> dict[str, Any]:
    """One that can be designed, and whose crane's rope does not have to push."""
    while True:
        name = rng.choice(list(plants))
        count = rng.choice([1, 1, 2, 2, 3])
        state = {
            "command": rng.choice(["step", "step", *rng.sample([v for g in page["commands"] for v, _ in g["items"]], 2)]),
            "size": rng.uniform(0.1, 0.5), "duration": rng.uniform(1.0, 4.0), "carrier": rng.uniform(8.0, 20.0),
            "shaper": rng.choice([value for value, _ in page["shapers"]]), "tolerance": rng.uniform(0.02, 0.1),
            "own": {"negative_amplitude": rng.uniform(0.3, 0.7), "equal_impulses": rng.randint(3, 5)},
            "frequency": [rng.uniform(2.0, 12.0) * 2.0**i for i in range(count)],
            "damping": [rng.uniform(0.0, 0.15) for _ in range(count)],
            "plant": name, "output": rng.randrange(len(plants[name].outputs)),
            "parameters": [min(s.high, max(s.low, s.start * rng.uniform(0.7, 1.4))) for s in plants[name].sliders],
        }  # fmt: skip
        try:
            shaper_of(state).initialize(0.0)
            Source(state, plants[name])
        except ComponentError:
            continue
        return state

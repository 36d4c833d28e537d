"""What plain Python components do with random values and inputs, as JSON; hosts of other languages replay it (hosts/kernels.js)."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

from test_kernels import PLANS, every_item, random_parameters
from trial_runs import CHOSEN, moved

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError
from shaper_fmu.export.wasm import LOADER, layout, wasm_module

REPLAY = Path(__file__).parent / "hosts" / "kernels.js"


def _values(plain: Component, *causalities: str) -> dict[str, Any]:
    return {v.name: getattr(plain, v.name) for v in plain.variables.values() if v.causality in causalities}


def _results(plain: Component) -> dict[str, Any]:
    found = _values(plain, "output", "local", "calculatedParameter")
    return {name: list(value) if isinstance(value, list) else value for name, value in found.items()}


def trace(component: type[Component], values: dict[str, Any], rng: random.Random, steps: int) -> dict[str, Any]:
    """Parameters, what the start gives, then steps: inputs, time and length, and what they give; null where it is refused."""
    plain = component(**values)
    told: dict[str, Any] = {"parameters": _values(plain, "parameter", "input"), "started": None, "steps": []}
    try:
        plain.initialize(0.0)
    except ComponentError:
        return told
    told["started"], t = _results(plain), 0.0
    for _ in range(min(steps, PLANS.get(component.__name__, steps))):
        for variable in component.variables.values():
            if variable.causality == "input":
                value = moved(variable, rng.choice([0.0, 0.05, rng.uniform(-0.1, 0.1)]))
                setattr(plain, variable.name, value if variable.size is None else [value] * variable.size)
        h, inputs = rng.choice([0.0, 0.01, 0.013, 0.05]), _values(plain, "input")
        try:
            plain.do_step(t, h)
        except ComponentError:
            told["steps"].append([inputs, t, h, None])
            return told
        told["steps"].append([inputs, t, h, _results(plain)])
        t += h
    return told


def traces(component: type[Component], rng: random.Random, random_ones: int, steps: int = 150) -> list[dict[str, Any]]:
    """Of the start values, every item of every enumeration, a case that shows much, and random parameters."""
    cases = [*every_item(component), CHOSEN.get(component.__name__, {})]
    cases += [random_parameters(component, rng) for _ in range(random_ones)]
    return [trace(component, values, rng, steps) for values in cases]


def replay_script(component: type[Component], given: list[dict[str, Any]]) -> str:
    """A script without files: kernel.js, the module, the traces; its last expression is a promise of `replayed` (see REPLAY)."""
    module = json.dumps(list(wasm_module(component)))
    parts = [LOADER.read_text(encoding="utf-8"), REPLAY.read_text(encoding="utf-8")]
    return "\n".join([*parts, f"replayed(new Uint8Array({module}), {json.dumps(layout(component))}, {json.dumps(given)})"])

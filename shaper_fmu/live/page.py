"""Writes the live page: one file with the kernels as WebAssembly, the charts and the examples."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2

from shaper_fmu.component import Component, Variable
from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import ArgumentError, ShaperFmuError
from shaper_fmu.export.documentation import ON_EVERY_LIVE_PAGE
from shaper_fmu.export.wasm import LOADER, layout, wasm_module
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.kinds.pulses import PULSES
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.live.curves import MoveCurve, PulseCurve, ShaperCurve
from shaper_fmu.live.firmwares import firmwares
from shaper_fmu.live.floor_table import TABLE
from shaper_fmu.live.plants import Plant, plant_of, usual_plants
from shaper_fmu.live.presets import presets
from shaper_fmu.page.chart import chart_script, chart_style
from shaper_fmu.registry import find_component
from shaper_fmu.version import __version__

_STATIC = Path(__file__).parent / "static"
_SCRIPTS = ("simulate.js", "state.js", "controls.js", "copies.js", "draw.js", "page.js")
_CURVES = (ShaperCurve, MoveCurve, PulseCurve)
_LEAST_SHARE = 0.01
"""Where a parameter's slider begins that must be larger than 0."""
_LEFT_OUT = ("step", "fastest")
"""Profiles that the page has in another way, or that have to be designed by optimisation first."""
_BEGIN = """\
(async () => {
  const page = JSON.parse(document.getElementById("data").textContent);
  const compiled = Object.entries(page.kernels).map(async ([name, { module, layout }]) => {
    const bytes = Uint8Array.from(atob(module), (letter) => letter.charCodeAt(0));
    return [name, { module: await WebAssembly.compile(bytes), layout }];
  });
  const kernels = Object.fromEntries(await Promise.all(compiled));
  globalThis.live = new LivePage(page, new Studio({ kernels, plants: page.plants }));
})();
"""


def write_live_page(path: Path | str, own: Sequence[type[Component]] = ()) -> Path:
    """Write the page, and return its path.

    Args:
        path: of the page; it ends with .html.
        own: further components as plants, such as a user's own; the first one is shown at the start.

    Raises:
        ShaperFmuError: for another ending, for a component that cannot be a plant, and for what does not compile.
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShaperFmuError(f"{path}: this is a page, and its file's name ends with .html")
    plants = plants_of(own)
    first = own[0].__name__ if own else next(iter(plants))
    text = page_of(page_data(plants, first))
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_of(path) as draft:
        draft.write_text(text, encoding="utf-8")
    return path


def page_of(data: dict[str, Any]) -> str:
    """The page with this data."""
    return jinja2.Template(_text("page.html")).render(
        style="\n".join([chart_style(), _text("page.css")]),
        script="\n".join([chart_script(), LOADER.read_text(encoding="utf-8"), *map(_text, _SCRIPTS)]),
        data=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        begin=_BEGIN,
        version=f"shaper-fmu {__version__}",
    )


def panel_data(plant: Plant, start: dict[str, Any]) -> dict[str, Any]:
    """The data of a page about one design: a step, shapers, one plant, and the state in which it begins."""
    components = panel_components(plant.component)
    name = plant.component.__name__
    return {
        "kernels": {component.__name__: _kernel(component) for component in components},
        "plants": {name: plant.described()},
        "firstPlant": name,
        "commands": [{"title": "step", "items": [["step", "step"]]}],
        **_choices(),
        "timed": [],
        "presets": [],
        "start": start,
        "floor": json.loads(TABLE.read_text(encoding="utf-8")),
    }


def page_components(plants: dict[str, Plant]) -> list[type[Component]]:
    """The components whose kernels a page with these plants carries."""
    return [*map(find_component, ON_EVERY_LIVE_PAGE), *_CURVES, *(plant.component for plant in plants.values())]


def panel_components(plant: type[Component]) -> list[type[Component]]:
    """The components whose kernels a page about one design carries."""
    return [find_component("InputShaper"), ShaperCurve, plant]


def plants_of(own: Sequence[type[Component]] = ()) -> dict[str, Plant]:
    """The usual plants and a user's own, by the components' names; where one has a usual one's name, it takes its place.

    Raises ArgumentError for what cannot be a plant, for a name that the page needs itself, and for two of one name.
    """
    found = {plant.component.__name__: plant for plant in usual_plants()}
    known = {plant.component for plant in found.values()}
    added: dict[str, type[Component]] = {}
    for component in own:
        name = component.__name__
        if name in (*ON_EVERY_LIVE_PAGE, *(curve.__name__ for curve in _CURVES)):
            raise ArgumentError(f"{name} is a part of the page itself and cannot be its plant; give the component another name")
        if added.setdefault(name, component) is not component:
            raise ArgumentError(f"two plants are called {name}; give one of them another name")
        if component not in known:
            found[name] = plant_of(component)
    return found


def page_data(plants: dict[str, Plant], first: str) -> dict[str, Any]:
    """All that the page knows, as plain data: kernels, plants, choices, examples and the table of the floor."""
    components = page_components(plants)
    usual = {plant.component.__name__: plant for plant in usual_plants()}
    unchanged = {name: plant for name, plant in plants.items() if usual.get(name) == plant}
    examples = [one for one in presets(usual) if one["state"]["plant"] in unchanged]
    return {
        "kernels": {component.__name__: _kernel(component) for component in components},
        "plants": {name: plant.described() for name, plant in plants.items()},
        "firstPlant": first,
        "commands": [
            {"title": "step", "items": [["step", "step"]]},
            {"title": "motion profiles", "items": [[name, _words(name)] for name in PROFILES if name not in _LEFT_OUT]},
            {"title": "pulse trains", "items": [[f"pulses:{name}", _words(name)] for name in PULSES]},
        ],
        **_choices(),
        "timed": [name for name, record in PULSES.items() if record.timed],
        "presets": examples,
        "floor": json.loads(TABLE.read_text(encoding="utf-8")),
    }


def _choices() -> dict[str, Any]:
    """The shapers, the parameters that only some of them have, and the firmwares that have shapers of their own."""
    return {
        "shapers": [["none", "none"], *([name, _words(name)] for name in SHAPERS)],
        "shaperParameters": {
            kind: [_slider(name, variable) for name, variable in record.parameters.items()]
            for kind, record in SHAPERS.items()
            if record.parameters
        },
        "firmwares": firmwares(),
    }


def _slider(name: str, variable: Variable[Any]) -> dict[str, Any]:
    """What a slider of a shaper's own parameter needs."""
    low = variable.min if variable.exclusive not in (True, "min") else _LEAST_SHARE
    return {
        "name": name,
        "label": variable.description,
        "start": variable.start,
        "low": low,
        "high": variable.max,
        "whole": variable.kind is int,
    }


def _kernel(component: type[Component]) -> dict[str, Any]:
    return {"module": base64.b64encode(wasm_module(component)).decode(), "layout": layout(component)}


def _text(name: str) -> str:
    return _STATIC.joinpath(name).read_text(encoding="utf-8")


def _words(name: str) -> str:
    return name.replace("_", " ")

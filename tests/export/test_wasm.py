"""Kernels as WebAssembly: every component gives the values of plain Python, in node and in a browser, and imports nothing."""

from __future__ import annotations

import json
import random

import pytest
from browser import browser, needs_chromium
from command_line import typed
from javascript import in_node, needs_node
from kernel_traces import replay_script, traces

from shaper_fmu.errors import BuildError
from shaper_fmu.export.native.toolchain import platform_named
from shaper_fmu.export.wasm import LOADER, layout, wasm_module
from shaper_fmu.registry import components, load_components

ROUNDING = 1e-9
"""The mathematics library is another one (musl's), whose last digits differ, and are amplified where a design is solved."""
LOOSER = {"ShapedStop": 1e-7, "HydraulicPendulum": 1e-7}
"""Its rest time is found by a search that ends at a tolerance; its pressures' rates are differences of flows that nearly cancel."""


@needs_node
@pytest.mark.representatives(name=["InputShaper", "MassSpringDamper"])
@pytest.mark.parametrize("name", components())
def test_node_computes_what_plain_python_does(name):
    """Every item of every enumeration, and random values, inputs and steps; what one refuses the other refuses."""
    component, rng = components()[name], random.Random(name)
    found = in_node(replay_script(component, traces(component, rng, 3)))
    assert found["wrong"] == []
    assert found["imports"] == 0
    assert found["compared"] > 100
    assert found["worst"] < LOOSER.get(name, ROUNDING), found["where"]


@needs_chromium
@pytest.mark.representatives(name=["InputShaper"])
@pytest.mark.parametrize("name", ["InputShaper", "MassSpringDamper", "OverheadCrane", "MotionProfile", "ThreeMassChain"])
def test_a_browser_computes_what_plain_python_does(name, tmp_path):
    component = components()[name]
    with browser(tmp_path) as chromium:
        chromium.open("about:blank")
        found = chromium.run(replay_script(component, traces(component, random.Random(name), 1, steps=40)))
    assert found["wrong"] == []
    assert found["compared"] > 100
    assert found["worst"] < ROUNDING, found["where"]


def test_modules_are_small():
    """InputShaper has 60 kB, most of it the mathematics library; a page carries half a dozen of them."""
    assert len(wasm_module(components()["InputShaper"])) < 90_000


@needs_node
def test_the_loader_names_what_is_wrong():
    component = components()["InputShaper"]
    script = f"""{LOADER.read_text()}
    (async () => {{
      const layout = {json.dumps(layout(component))};
      const kernel = new Kernel(await WebAssembly.compile(new Uint8Array({list(wasm_module(component))})), layout);
      const said = (call) => {{ try {{ call(); return ""; }} catch (error) {{ return error.message; }} }};
      return [
        said(() => kernel.set("shaper", "zvv")), said(() => kernel.set("modes", 1.5)), said(() => kernel.set("nothing", 1)),
        said(() => kernel.set("shaped", 1)), said(() => kernel.set("damping_ratio", [0, 0, 0, 0, 0])),
        said(() => {{ kernel.set("natural_frequency", [-1]); kernel.start(0); }}),
        said(() => {{ kernel.reset(); kernel.set("shaper", "custom"); kernel.set("custom_delay", [0, 0.2, 0.1]);
                      kernel.set("custom_impulses", 3); kernel.start(0); }}),
      ];
    }})()"""
    assert in_node(script) == [
        "InputShaper: zvv is not a value of shaper",
        "InputShaper: modes = 1.5 is not of type integer",
        "InputShaper has no variable nothing",
        "InputShaper: shaped is no input and no parameter",
        "InputShaper: damping_ratio has 4 elements, not 5",
        "InputShaper: value outside of its domain: natural_frequency = -1, t = 0 s",
        "InputShaper: custom_delay must begin with 0 s and not decrease over the first 3 elements (t = 0 s)",
    ]


@needs_node
def test_a_fault_is_named_with_its_place(tmp_path):
    """kernel.h keeps what Python raises: here a division by zero."""
    file = tmp_path / "own.py"
    file.write_text(
        '"""x"""\nfrom shaper_fmu.component import Component, Input, Output\n\n\nclass Inverse(Component):\n    """One over x."""\n\n'
        '    x = Input("", "a number", start=1.0)\n    y = Output("", "its inverse")\n\n'
        "    def step(self, t, h):\n        self.y = 1.0 / self.x\n"
    )
    (component,) = load_components(file)
    script = f"""{LOADER.read_text()}
    WebAssembly.compile(new Uint8Array({list(wasm_module(component))})).then((module) => {{
      const kernel = new Kernel(module, {json.dumps(layout(component))});
      kernel.start(0);
      kernel.set("x", 0);
      try {{ kernel.step(0.5, 0.1); }} catch (error) {{ return error.message; }}
    }})"""
    assert in_node(script) == "Inverse: division by zero (own.py:12), t = 0.5 s"


def test_the_command_line_writes_module_layout_and_loader(tmp_path):
    done = typed("build", "MassSpringDamper", "--wasm", tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["MassSpringDamper.json", "MassSpringDamper.wasm", "kernel.js"]
    component = components()["MassSpringDamper"]
    assert (tmp_path / "MassSpringDamper.wasm").read_bytes() == wasm_module(component)
    assert json.loads((tmp_path / "MassSpringDamper.json").read_text()) == layout(component)


def test_fmus_are_not_built_for_wasm32():
    with pytest.raises(BuildError, match="--wasm FOLDER"):
        platform_named("wasm32")

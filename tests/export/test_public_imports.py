"""A component's file may import the public names from the top: `from shaper_fmu import Component`."""

from __future__ import annotations

from pathlib import Path

import pytest

from shaper_fmu import System, build_fmu
from shaper_fmu.errors import BuildError
from shaper_fmu.registry import load_components

SOURCE = '''\
"""A double integrator with the field's names é."""; from shaper_fmu import Component as Base; from shaper_fmu import (
    Input,  # a comment
    Output, Parameter,
)
from shaper_fmu import time_tolerance


class Cart(Base):
    """Moves."""

    force = Input("N", "force")
    mass = Parameter(2.0, "kg", "mass", min=0.0, exclusive=True)
    velocity = Output("m/s", "velocity")
    position = Output("m", "position", depends=())

    def step(self, t, h):
        a = self.force / self.mass
        if h > time_tolerance(self, t, h):
            self.position += self.velocity * h + 0.5 * a * h * h
        self.velocity += a * h
'''


def cart(folder: Path, source: str = SOURCE) -> Path:
    (folder / "cart.py").write_text(source, encoding="utf-8")
    return folder / "cart.py"


@pytest.mark.parametrize("options", [{"backend": "python"}, {"platforms": ["this"]}], ids=["python", "native"])
def test_a_component_that_imports_from_the_top_runs_as_an_fmu(tmp_path, options):
    component = load_components(cart(tmp_path))[0]
    system = System()
    system.add("cart", build_fmu(component, tmp_path, **options), mass=4.0)
    system.drive("cart.force", 8.0)
    results = system.simulate(1.0, 0.1)
    assert results["cart.position"][-1] == pytest.approx(0.5 * 2.0 * 1.0**2, rel=1e-14)  # a t^2 / 2


def test_lines_keep_their_numbers(tmp_path):
    """So that a traceback out of an FMU names the line of the file that the user wrote."""
    from shaper_fmu.export.closure import packed_sources

    component = load_components(cart(tmp_path))[0]
    root, files = packed_sources(component)
    packed = files[f"{root}/component_cart.py"].splitlines()
    written = SOURCE.splitlines()
    assert len(packed) == len(written)
    assert packed[5:] == written[5:]
    assert packed[0].endswith(f"from {root}.shaper_fmu.variable import Input, Output, Parameter")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("from shaper_fmu import Compnent", "line 2: shaper_fmu has no public name 'Compnent'. Did you mean 'Component'?"),
        (
            "from shaper_fmu.shapers import ShapeMethod",
            "line 2: shaper_fmu.shapers has no public name 'ShapeMethod'. Did you mean 'ShaperMethod'?",
        ),
        ("import shaper_fmu", "line 2: write 'from shaper_fmu import ...'"),
    ],
)
def test_a_name_that_is_none_is_told(tmp_path, line, words):
    component = load_components(cart(tmp_path))[0]
    cart(tmp_path, f"import math\nif not math: {line}\n{SOURCE}")
    with pytest.raises(BuildError, match=words.replace("'", ".").replace("?", ".")):
        build_fmu(component, tmp_path, backend="python")

"""The command `shaper-fmu live`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.cli.arguments import PAGE, input_file, output_file, wrong_usage
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.paths import wrote
from shaper_fmu.component import Component
from shaper_fmu.console import err
from shaper_fmu.progress import progress


def live(
    plants: Annotated[
        list[str] | None,
        typer.Option(
            "--plant", help="A component as a further plant: its name, or a Python file with components; may be repeated."
        ),
    ] = None,
    output: Annotated[Path, typer.Option(help="Page to write.", callback=output_file(*PAGE))] = Path("live.html"),
    force: Force = False,
) -> None:
    """Write a page on which shaping is tried: sliders for command, shaper and plant, redrawn while they move.

    It is one file, which needs no network and no installation. Example: shaper-fmu live --plant my_plant.py --output live.html
    """
    from shaper_fmu.live.page import plants_of, write_live_page

    check_kept(output, force, "--output")
    own = [component for name in plants or [] for component in _components(name)]
    with wrong_usage("--plant"):
        plants_of(own)
    with progress("compiling the kernels", err):
        path = write_live_page(output, own)
    wrote(path, f": {path.stat().st_size / 1e3:.0f} kB")


def _components(name: str) -> list[type[Component]]:
    from shaper_fmu.registry import find_component, load_components

    if name.endswith(".py"):
        input_file()(Path(name))
    with wrong_usage("--plant"):
        return load_components(Path(name)) if name.endswith(".py") else [find_component(name)]

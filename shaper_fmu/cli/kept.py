"""Files that another call made are not overwritten in silence: pages and drawings tell by their titles what they are of."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.cli.paths import shown

_BEGINNING = 20_000
"""Bytes in which the title is looked for."""

Force = Annotated[bool, typer.Option("--force", help="Overwrite a page or drawing that is of something else.")]


def check_kept(path: Path, title: str, force: bool, option: str) -> None:
    """Raise BadParameter if a page or drawing is there that has another title, or none, unless it is to be overwritten."""
    if force or not path.is_file() or path.stat().st_size == 0:
        return
    with open(path, "rb") as stream:
        found = re.search(r"<title>(.*?)</title>", stream.read(_BEGINNING).decode(errors="replace"), re.DOTALL)
    other = html.unescape(found[1]) if found else None
    if other != title:
        what = f"is there already: {other!r:.100}" if other is not None else "is there already, and was not made by this command"
        raise typer.BadParameter(f"{shown(path)} {what}; give another name, or --force to overwrite it", param_hint=option)

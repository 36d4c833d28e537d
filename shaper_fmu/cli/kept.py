"""Files that another call made are not overwritten in silence; the same call may write its own again (see made.py)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.cli.made import known_call, this_call
from shaper_fmu.cli.paths import shown

Force = Annotated[bool, typer.Option("--force", help="Overwrite a file that another call has made.")]


def check_kept(path: Path | None, force: bool, option: str, call: list[str] | None = None) -> None:
    """Raise BadParameter if a file is there that another call made, or that was changed since, unless it is to be overwritten.

    `call`: by what the call is known, where not by all its words.
    """
    if path is None or force or not path.is_file() or path.stat().st_size == 0:
        return
    known = known_call(path)
    if known == (call if call is not None else this_call()):
        return
    what = f"made by: shaper-fmu {' '.join(known[:-1])}" if known and call is None else "not made by this call"
    message = f"{shown(path)} is there already, {what:.200}; give another name, or --force to overwrite it"
    raise typer.BadParameter(message, param_hint=option)

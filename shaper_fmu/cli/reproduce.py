"""The command `shaper-fmu reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shaper_fmu.cli.arguments import output_folder
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.cli.paths import wrote
from shaper_fmu.console import err, out, show
from shaper_fmu.errors import ShaperFmuError, nearest
from shaper_fmu.page.blocks import Table
from shaper_fmu.progress import progress
from shaper_fmu.reproduce import NAMES
from shaper_fmu.reproduce import reproduce as run_again

if TYPE_CHECKING:
    from shaper_fmu.page.blocks import Block
    from shaper_fmu.reproduce.claims import Reproduction

HEAD = ("claim", "found", "verdict", "why")
_STYLES = {
    "reproduced": "green", "reproduced (labels exchanged)": "green", "not reproduced": "red", "not decidable": "yellow",
}  # fmt: skip


def reproduce(
    name: Annotated[str, typer.Argument(help=f"Papers to reproduce: {', '.join(NAMES)}, or all.")] = "all",
    output: Annotated[Path, typer.Option(help="Folder for the pages and pictures.", callback=output_folder)] = Path("results"),
    force: Force = False,
) -> None:
    """Repeat the papers' studies with the FMUs; give a verdict for each claim, a page and pictures.

    A claim that does not hold is a result, not an error: the exit code is 1 only if a run fails.
    """
    if name != "all" and name not in NAMES:
        raise typer.BadParameter(f"there is no {name!r}.{nearest(name, [*NAMES, 'all'])}", param_hint="NAME")
    for key in NAMES if name == "all" else (name,):
        check_kept(_page(output, key), force, "--output", _call(key))
    tell_missing(pages=True)
    failed = False
    for key in NAMES if name == "all" else (name,):
        try:
            with progress(f"reproducing {key}", err) as update:
                found = run_again(key, update)
            _show(found)
            _write(found, output)
        except ShaperFmuError as error:
            failed = True
            err.print(f"error: {key}: {error}")
    if failed:
        raise typer.Exit(1)


def _show(found: Reproduction) -> None:
    """The claims as a table that wraps, or piped as plain lines."""
    out.print(f"{found.title}\n{found.paper}")
    if out.breaks_lines:
        show(_claims(found), lines=True, styles=_STYLES)
    else:
        for claim in found.claims:
            out.print(f"- {claim.verdict}: {claim.statement}\n    found: {claim.number}\n    why: {claim.why}")
    out.print(tally(found))


def _claims(found: Reproduction, title: str = "") -> Table:
    return Table(title, list(HEAD), [[one.statement, one.number, one.verdict, one.why] for one in found.claims], left_aligned=True)


def tally(found: Reproduction) -> str:
    """The number of claims of each verdict, as a text."""
    verdicts = [claim.verdict for claim in found.claims]
    return f"{found.key}: " + ", ".join(f"{verdicts.count(v)} {v}" for v in _STYLES if v in verdicts)


def _write(found: Reproduction, output: Path) -> None:
    from shaper_fmu.page.blocks import Text, write_report

    blocks: list[Block] = [Text(found.paper), _claims(found, "Claims"), Text(tally(found)), *found.blocks]
    output.mkdir(parents=True, exist_ok=True)
    for path in write_report(_page(output, found.key), found.title, blocks):
        wrote(path, call=_call(found.key))


def _page(output: Path, key: str) -> Path:
    return output / f"reproduce_{key}.html"


def _call(key: str) -> list[str]:
    """By what a page is known: the same whether one paper is reproduced, or all."""
    return ["reproduce", key]

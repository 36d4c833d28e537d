"""Writes a report: one self-contained HTML page, and a picture of each figure beside it."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import markupsafe

from shaper_fmu.drafts import draft_of
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.page.chart import STATIC, chart_script, chart_style, map_script
from shaper_fmu.page.figures import Figure, Map, Panels
from shaper_fmu.page.interactive import interactive, interactive_map


@dataclass(frozen=True)
class Text:
    """A paragraph; with `folded` it is behind this title until a reader opens it."""

    text: str
    folded: str = ""


@dataclass(frozen=True)
class Table:
    """A table of texts under a heading; the first column is left-aligned, the others right: all of them left if `left_aligned`.

    With `folded` it is behind its heading until a reader opens it.
    """

    title: str
    head: list[str]
    rows: list[list[str]]
    left_aligned: bool = False
    folded: bool = False


@dataclass(frozen=True)
class Heading:
    """Begins a section of the page, and is listed at its top."""

    text: str


@dataclass(frozen=True)
class Drawing:
    """A drawing as an SVG element, which has the colours of the text around it. It is put into the page as it stands."""

    title: str
    svg: str


@dataclass(frozen=True)
class Live:
    """A page inside of the page, which runs WebAssembly: it is behind its title until a reader opens it."""

    title: str
    page: str


Block = Drawing | Heading | Live | Text | Table | Figure | Map | Panels

Progress = Callable[[float, float], None]
"""Called now and then with what is done, and of how much."""

_WORD = 24
"""Letters of the longest word that is never broken; paths and numbers can be longer."""


def _breakable(text: str) -> bool:
    """Whether a word of a cell may be broken where the page is narrow, since it is longer than any word of a language."""
    return any(len(word) > _WORD for word in text.split())


_PAGES = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
_PAGES.tests["breakable"] = _breakable
_PAGE = _PAGES.from_string(STATIC.joinpath("page.html").read_text(encoding="utf-8"))


def write_report(
    path: Path | str, title: str, blocks: Sequence[Block], pictures: Sequence[str] = ("png",), progress: Progress | None = None
) -> list[Path]:
    """Write the page and pictures of each figure, <page>_<figure>.png or .svg; returns all paths, the page first.

    Without matplotlib, which draws the pictures, it is the page alone. Raises ShaperFmuError for a path that is no page's.
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ShaperFmuError(f"{path}: a report is a page, and its file's name ends with .html")
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_of(path) as draft:
        draft.write_text(page_text(title, blocks), encoding="utf-8")
    written, figures = [path], [block for block in blocks if isinstance(block, Figure | Map | Panels)]
    if not can_draw():
        return written
    from shaper_fmu.page.pictures import write_map_picture, write_picture, write_pictures

    for i, block in enumerate(figures):
        files = [path.with_name(f"{path.stem}_{block.key}.{kind}") for kind in pictures]
        if files and isinstance(block, Figure):
            write_picture(block, *files)
        elif files and isinstance(block, Map):
            write_map_picture(block, *files)
        elif files and isinstance(block, Panels):
            write_pictures(block.figures, *files, columns=2, title=block.title)
        written += files
        if progress is not None:
            progress(i + 1, len(figures))
    return written


def can_draw() -> bool:
    """Whether matplotlib is there, which draws pictures."""
    return importlib.util.find_spec("matplotlib") is not None


def page_text(title: str, blocks: Sequence[Block]) -> str:
    """The page: one file that loads nothing, the same for the same blocks."""
    kinds = {type(block) for block in blocks}
    style, scripts = [_static("page.css")], [_static("folded.js")]
    if kinds & {Figure, Map, Panels}:
        style.insert(0, chart_style())
        scripts += [chart_script(), *([map_script()] if Map in kinds else []), _static("report.js")]
    return _PAGE.render(
        title=title,
        style=markupsafe.Markup("\n".join(style)),
        script=markupsafe.Markup("\n".join(scripts)),
        figures=len(scripts) > 1,
        live=Live in kinds,
        blocks=[(type(block).__name__, block) for block in blocks],
        drawn=lambda block: interactive(block) if isinstance(block, Figure) else interactive_map(block),
    )


def _static(name: str) -> str:
    return STATIC.joinpath(name).read_text(encoding="utf-8")

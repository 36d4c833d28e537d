"""The documentation hangs together: relative links lead somewhere, and every page in docs/ is linked from the README."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("docs", "ssp", "examples")
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md")),
]
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())


def prose(page: Path) -> str:
    """The page without blocks of code and code in a line."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^ {4}.*$|`[^`\n]*`(?!\])", "", text, flags=re.MULTILINE)


def links(page: Path) -> list[str]:
    """The targets of links and pictures that are not in the web."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(page))
    return [target for target in found if not re.match(r"[a-z]+:", target)]


def anchors(page: Path) -> set[str]:
    """The names by which its headings can be linked, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@every_page
def test_relative_links_lead_somewhere(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        place = (page.parent / path).resolve() if path else page
        assert place.exists(), target
        assert place.is_relative_to(ROOT), target
        assert not anchor or anchor in anchors(place), target


@every_page
def test_files_that_are_named_are_there(page):
    """Paths in code, such as `tests/components/test_plants.py`, are relative to the repository; a name with a star stands for several."""
    named = re.findall(r"`((?:tests|examples|docs|plants|shaper_fmu|ssp|bench)/[\w./*]+)`", page.read_text(encoding="utf-8"))
    for name in named:
        if not name.endswith((".ssp", "results.json")):  # these are made
            assert list(ROOT.glob(name.rstrip("/"))), name


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.parent != ROOT], ids=lambda path: path.relative_to(ROOT).as_posix()
)
def test_a_page_is_read_in_minutes(page):
    """Below 1,500 words; docs/python.md is a list to look things up."""
    assert page.name == "python.md" or len(page.read_text(encoding="utf-8").split()) < 1500


def test_the_readme_links_every_page_of_the_documentation():
    linked = {(ROOT / target.partition("#")[0]).resolve() for target in links(ROOT / "README.md")}
    missing = [path.relative_to(ROOT).as_posix() for path in PAGES if path.is_relative_to(ROOT / "docs") and path not in linked]
    assert missing == []
    assert len(PAGES) > 10

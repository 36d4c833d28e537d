"""What imports what: archives are above the master and below sweeps, reports and tune; no circles among the modules of archives."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "shaper_fmu"


def imported(path: Path) -> set[str]:
    """The modules of this package that a file imports anywhere, inside functions, too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in found if name.startswith("shaper_fmu.")}


def test_archives_know_nothing_of_what_uses_them():
    above = ("sweep", "report", "tune", "page", "reproduce", "cli")
    for path in (PACKAGE / "ssp").glob("*.py"):
        assert not [name for name in imported(path) if name.split(".")[1].split("_")[0] in above], path


def test_the_master_knows_nothing_of_archives():
    for path in (PACKAGE / "master").glob("*.py"):
        assert not [name for name in imported(path) if name.startswith("shaper_fmu.ssp")], path


def test_the_modules_of_archives_have_no_circles():
    own = {f"shaper_fmu.ssp.{path.stem}": imported(path) for path in (PACKAGE / "ssp").glob("*.py")}
    edges = {name: {other for other in others if other in own and other != name} for name, others in own.items()}
    assert len(list(TopologicalSorter(edges).static_order())) == len(own) > 20

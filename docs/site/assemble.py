"""Gathers the pages of the documentation site: those of the repository where they lie, so that their links hold, and the reference.

`python docs/site/assemble.py FOLDER` writes them; `make docs` has mkdocs make the site of them.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

from shaper_fmu.export.documentation import start_text, type_text
from shaper_fmu.export.model_description import summary, visible_variables
from shaper_fmu.public_names import homes, packages, public
from shaper_fmu.registry import components

ROOT = Path(__file__).parents[2]
COPIED = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SECURITY.md",
    "LICENSE",
    "docs",
    "examples",
    "ssp",
    "plants",
    "bench",
    "tests",
)
SHOWN = {".md", ".png", ".svg", ".py", ".toml", ".css", ".ssd", ".ssv", ".json", ".ipynb"}
"""What pages may link to; the rest of the folders stays behind."""


def assemble(folder: Path) -> None:
    """Write the pages into a folder, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in COPIED:
        for source in [ROOT / name] if (ROOT / name).is_file() else sorted((ROOT / name).rglob("*")):
            if (
                source.is_file()
                and (source.suffix in SHOWN or source.name == "LICENSE")
                and not source.is_relative_to(ROOT / "docs" / "site")
            ):
                target = folder / source.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
    (folder / "README.md").rename(folder / "index.md")
    shutil.copyfile(ROOT / "docs" / "site" / "site.css", folder / "site.css")
    _relink(folder)
    reference = folder / "reference"
    reference.mkdir()
    (reference / "command_line.md").write_text(_command_line())
    (reference / "fmus.md").write_text(_fmus())
    (reference / "python.md").write_text(_python())
    (folder / "gallery.md").write_text(_gallery())


def _relink(folder: Path) -> None:
    """Links to the README lead to the first page, which it is on the site."""
    for page in [*folder.glob("*.md"), *folder.glob("docs/**/*.md")]:
        text = page.read_text(encoding="utf-8")
        page.write_text(re.sub(r"(\]\((?:\.\./)*)README\.md(?=[#)])", r"\1index.md", text), encoding="utf-8")


def _command_line() -> str:
    """The commands' help, as they print it."""
    made = [
        sys.executable,
        "-m",
        "typer",
        "shaper_fmu.cli.main",
        "utils",
        "docs",
        "--name",
        "shaper-fmu",
        "--title",
        "Command line",
    ]
    return subprocess.run(made, capture_output=True, text=True, check=True).stdout


def _fmus() -> str:
    """A section for each component, with a table of its variables."""
    text = "# Variables of the FMUs\n\nAll quantities are in SI units.\n"
    head = "| variable | causality | type | unit | start | what it is |\n|---|---|---|---|---|---|\n"
    for name, component in components().items():
        rows = [
            [
                f"`{v.name}`",
                v.causality,
                type_text(v),
                v.unit,
                start_text(v) if v.causality in ("input", "parameter") else "",
                v.description,
            ]
            for v in visible_variables(component)
        ]
        lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
        text += f"\n## {name}\n\n{summary(component)}\n\n{head}" + "\n".join(lines) + "\n"
    return text


def _python() -> str:
    """All public names with their docstrings, by package."""
    text = "# Python reference\n\nThe public names, by package. [Python](../docs/python.md) is the overview.\n"
    for package in packages():
        text += f"\n## {package}\n"
        text += "".join(f"\n::: {homes(package)[name]}.{name}\n" for name in public(package) if name in homes(package))
    return text


def _gallery() -> str:
    """The examples and the systems with their pictures."""
    text = "# Gallery\n\n## Systems\n"
    for page in sorted((ROOT / "ssp").glob("*/README.md")):
        title = page.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
        text += f"\n### [{title}](ssp/{page.parent.name}/README.md)\n"
        if (page.parent / "picture.png").exists():
            text += f"\n![{title}](ssp/{page.parent.name}/picture.png)\n"
    text += "\n## Examples\n"
    for script in sorted((ROOT / "examples").glob("[0-9]*.py")):
        said = script.read_text(encoding="utf-8").split('"""')[1].strip().splitlines()[0]
        text += f'\n### {script.stem[3:].replace("_", " ").capitalize()}\n\n{said}\n\n??? example "examples/{script.name}"\n\n'
        text += (
            "    ```python\n" + "".join(f"    {line}\n" for line in script.read_text(encoding="utf-8").splitlines()) + "    ```\n"
        )
    return text


if __name__ == "__main__":
    assemble(Path(sys.argv[1]))

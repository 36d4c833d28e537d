"""A container's library from changed sources, or by another compiler."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from native_host import gcc

from shaper_fmu.container import library
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.master.loop_library import LOOP

RUNTIME = Path(library.__file__).parent / "runtime"


def changed_runtime(folder: Path, file: str, old: str, new: str) -> Path:
    """A copy of the sources with another text in the place of one."""
    runtime = folder / "runtime"
    shutil.copytree(RUNTIME, runtime)
    text = (runtime / file).read_text()
    assert old in text, f"{file} has changed: give another fault here"
    (runtime / file).write_text(text.replace(old, new, 1))
    return runtime


def sources(folder: Path, fmi: int, runtime: Path = RUNTIME) -> tuple[list[str], list[str]]:
    """The C files and the compiler's options for the folders of headers; what is generated is written to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    files, includes = library.write_sources(folder, fmi)
    files = [runtime / file.name if file.parent == RUNTIME else file for file in files]
    return [str(file) for file in files], [f"-I{runtime if include == RUNTIME else include}" for include in includes]


def compiled_container(fmi: int, flags: tuple[str, ...], runtime: Path = RUNTIME) -> Path:
    """The library, by gcc with these flags; it is kept in the cache."""
    with tempfile.TemporaryDirectory() as scratch:
        files, includes = sources(Path(scratch), fmi, runtime)
        known = [file for folder in (runtime, LOOP, Path(scratch)) for file in sorted(folder.glob("*.[ch]"))]
        key = digest(
            str(fmi), *flags, *[part for file in known for part in (file.name, file.read_bytes())], Path(__file__).read_bytes()
        )

        def make() -> bytes:
            target = Path(scratch) / "library.so"
            options = ["-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", *includes, *flags]
            gcc([*options, *files, "-lm", "-ldl", "-o", str(target)])
            return target.read_bytes()

        return cached("sanitized", f"container{fmi}-{key}.so", make)

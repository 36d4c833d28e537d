"""What workers of a test run need in common is compiled once: each does what no other one has begun, then waits for the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from shaper_fmu import Final, System
from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.master.batch import Batch, Plan


def compile_once(components: Mapping[str, type[Component]], folder: Path) -> None:
    """Compile the master's loop, and the FMUs of these components for this machine, into the caches.

    The workers share `folder`. What cannot be compiled is left to the tests that need it, which fail.
    """
    tasks: dict[str, Callable[[], None]] = {"the loop": lambda: _compile_loop(components["MassSpringDamper"], folder)}
    tasks |= {name: lambda component=component: _compile_fmu(component, folder) for name, component in components.items()}
    others = [name for name, task in tasks.items() if not _done_here(task, folder / name)]
    for name in others:
        with FileLock(folder / f"{name}.lock"):
            pass


def _done_here(task: Callable[[], None], mark: Path) -> bool:
    """Do the task unless it has been done; False if another worker is at it."""
    try:
        with FileLock(mark.with_name(f"{mark.name}.lock"), timeout=0):
            if not mark.exists():
                mark.touch()
                task()
    except Timeout:
        return False
    return True


def _compile_fmu(component: type[Component], folder: Path) -> None:
    with suppress(BuildError):
        build_fmu(component, folder, platforms=["this"])


def _compile_loop(plant: type[Component], folder: Path) -> None:
    """Run what all entries of the loop are compiled for: a run, one whose input is a function, a batch."""
    fmu = build_fmu(plant, folder / "plant", platforms=["this"])
    for force in (1.0, lambda t: t):
        system = System()
        system.add("plant", fmu, force=force)
        system.simulate(0.2, 0.1)
    system = System()
    system.add("plant", fmu, force=1.0)
    with Batch(system, Plan(0.2, 0.1), {"end": Final("plant.position")}, []) as batch:
        batch.run({})

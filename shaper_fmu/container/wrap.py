"""Wraps a plant: an FMU with the plant's whole interface, in which shapers come before some of its inputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from shaper_fmu.container.build import Packed, pack
from shaper_fmu.container.head import Experiment
from shaper_fmu.container.inner import inner_starts, zero
from shaper_fmu.container.interface import check_version
from shaper_fmu.container.platforms import platforms_of
from shaper_fmu.container.wrapping import not_wrapped, time_of, wrapped_variables
from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.native.toolchain import USUAL_PLATFORMS
from shaper_fmu.master.fmu import Fmu, load_fmu
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import kind_of

PLANT, SHAPER = "plant", "shaper"


def wrap(
    plant: Fmu | Path | str,
    inputs: Sequence[str] | str,
    path: Path | str,
    shaper: Mapping[str, Any],
    *,
    fmi: int | None = None,
    description: str = "",
    **options: Any,
) -> Packed:
    """Write an FMU that replaces the plant's, with these real inputs shaped; `shaper` are start values of an InputShaper.

    It has the plant's variables, under their names, and the shapers' parameters, for example "shaper.natural_frequency[1]". `fmi`
    is 2 or 3, by default the plant's own; the `options` are those of `pack`. Raises ModelError and BuildError.
    """
    inputs = [inputs] if isinstance(inputs, str) else inputs  # one name alone is no list of letters
    fmu = plant if isinstance(plant, Fmu) else load_fmu(plant)
    version = fmi if fmi is not None else max(2, fmu.version)
    system = wrapped_system(fmu, inputs, shaper, version)
    packed = pack(
        system,
        wrapped_variables(system, version),
        path,
        fmi=version,
        description=description or f"{fmu.name} with {' and '.join(inputs)} shaped.",
        experiment=_experiment(fmu),
        time=time_of(system),
        own_tolerances=False,  # the plant hears what it would hear without a container
        **options,
    )
    notes = tuple(f"not shown: {text}" for text in not_wrapped(system, version))
    own = platforms_of(fmu)  # that the shaper has more is nobody's concern
    return Packed(packed.path, packed.platforms, tuple(name for name in packed.left_out if name in own), (*packed.notes, *notes))


def other_starts(fmu: Fmu, settings: Mapping[str, Any]) -> Iterator[str]:
    """Where a plant starts otherwise than a tuning was told to have it."""
    for name, value in settings.items():
        own = fmu.variables[name].start if name in fmu.variables else None
        with suppress(ValueError):
            if own is not None and float(value) != float(own):
                there = f"{fmu.name} starts with {float(own):g}"
                yield f"the tuning is for {name} = {float(value):g}, but {there}: set it where the FMU is used"


def wrapped_system(fmu: Fmu, inputs: Sequence[str], shaper: Mapping[str, Any], fmi: int) -> SystemStructure:
    """The plant behind a shaper for each of these inputs. Raises ModelError for names and values that do not fit."""
    check_version(fmi)
    check_inputs(fmu, inputs)
    system = SystemStructure(Path(fmu.name).stem)
    system.add(PLANT, fmu)
    source = load_fmu(_shaper_path(fmu, fmi))
    for number, name in enumerate(inputs, 1):
        instance = SHAPER if number == 1 else f"{SHAPER}_{number}"
        rest = _start(fmu, name)
        system.add(instance, source, {"command": rest, "initial_command": rest, **shaper})
        system.connect(f"{instance}.shaped", f"{PLANT}.{name}")
    return system


def check_inputs(fmu: Fmu, inputs: Sequence[str]) -> None:
    """Raise ModelError unless these are inputs of real numbers, at least one and none twice."""
    known = [name for name, v in fmu.variables.items() if v.causality == "input" and kind_of(v) == "real"]
    problems = [f"{fmu.name} has no input {name!r} of real numbers.{nearest(name, known)}" for name in inputs if name not in known]
    problems += [f"input {name} is named twice" for name in sorted({name for name in inputs if list(inputs).count(name) > 1})]
    if not known:
        problems = [f"{fmu.name} has no input of real numbers, so there is nothing to shape"]
    elif not inputs:
        problems.append(f"name the input that is shaped.{nearest('', known)}")
    if problems:
        raise ModelError(problems)


def _start(fmu: Fmu, name: str) -> float:
    """The start value of a plant's input, at which its command rests before the start."""
    variable = fmu.variables[name]
    (own,) = inner_starts(fmu, variable, [name])
    return float(zero(variable) if own is None else own)


def _shaper_path(fmu: Fmu, fmi: int) -> Path:
    """The shaper's FMU, for the plant's platforms."""
    platforms = platforms_of(fmu)
    usual = set(platforms) <= set(USUAL_PLATFORMS)
    return fmu_path("InputShaper", fmi, platforms=[] if usual else platforms)


def _experiment(fmu: Fmu) -> Experiment:
    declared = fmu.description.defaultExperiment
    if declared is None:
        return Experiment()
    texts = (declared.startTime, declared.stopTime, declared.stepSize, declared.tolerance)
    return Experiment(*[float(text) if text else None for text in texts])

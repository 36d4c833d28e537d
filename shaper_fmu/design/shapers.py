"""Designs shapers in Python, with the same kernels as the FMU; returns an `ImpulseSequence`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from shaper_fmu.component import Parameter, Variable
from shaper_fmu.design.impulse_sequence import ImpulseSequence, convolve_all
from shaper_fmu.errors import ArgumentError, NoSolutionError, nearest
from shaper_fmu.kinds.one_mode import design_mode
from shaper_fmu.kinds.shapers import FURTHER_PARAMETERS, PARAMETERS, SOLVED_WITH, Shaper
from shaper_fmu.methods.record import declare
from shaper_fmu.shapers.workspace import DesignWorkspace
from shaper_fmu.slips import checked_numbers


class _Workspace(DesignWorkspace):
    """The record in which the kernels design for `shaper`, with the parameters of all methods."""

    vibration_tolerance = Parameter(0.05, "", "tolerated V", min=0.0, max=1.0, exclusive=True)
    declare(locals(), PARAMETERS)
    declare(locals(), FURTHER_PARAMETERS)


OPTIONS = {name: variable for name, variable in _Workspace.variables.items() if variable.causality == "parameter"}
"""What `shaper` takes beside modes: the methods' own parameters and the tolerance, by name."""


_FASTEST = 1e100
"""Above this [rad/s] the square of a frequency would not be a finite number."""


def shaper(
    kind: str | Shaper,
    natural_frequency: float | Sequence[float],
    damping_ratio: float | Sequence[float] = 0.0,
    *,
    vibration_tolerance: float = 0.05,
    **parameters: float,
) -> ImpulseSequence:
    """The impulses of a shaper, convolved over the modes if several are given.

    Args:
        kind: a name of `Shaper`, such as "zvd" or "two_hump_ei" (custom ones are an `ImpulseSequence` of your own).
        natural_frequency: undamped natural frequency of each mode [rad/s].
        damping_ratio: of each mode, or one for all; 0 <= zeta < 1.
        vibration_tolerance: tolerated V of the EI shapers, 0 < V < 1.
        parameters: those that the kinds declare: negative_amplitude, size of the negative impulse of sna_zv, 0 < b <= 1;
            equal_impulses, number of impulses of miszv, 2 to 16.

    Raises ArgumentError for a value outside its domain, and when no such shaper exists.
    """
    chosen = _kind(kind)
    checked_numbers("natural_frequency", natural_frequency)
    checked_numbers("damping_ratio", damping_ratio)
    frequencies = _numbers("natural_frequency", natural_frequency)
    ratios = _numbers("damping_ratio", damping_ratio)
    if len(ratios) == 1:
        ratios = ratios * len(frequencies)
    if len(ratios) != len(frequencies):
        raise ArgumentError(f"{len(ratios)} damping ratios for {len(frequencies)} natural frequencies")
    given = _options({"vibration_tolerance": vibration_tolerance, **parameters})
    sequences: list[ImpulseSequence] = []
    for w, zeta in zip(frequencies, ratios, strict=True):
        _check("natural_frequency", w, 0.0 < w < float("inf"), "> 0 rad/s")
        _check("natural_frequency", w, w <= _FASTEST, f"<= {_FASTEST:g} rad/s")
        _check("damping_ratio", zeta, 0.0 <= zeta < 1.0, "0 <= zeta < 1")
        if chosen == Shaper.none:
            continue
        workspace: Any = _Workspace(**given)
        count = design_mode(workspace, chosen, zeta)
        if count == 0:
            reached = f"the damping ratio {zeta:g}, only up to {workspace.damping:.4g}"
            options = ", ".join(f"{name} {getattr(workspace, name):g}" for name in SOLVED_WITH)
            raise NoSolutionError(
                f"no {chosen.name} shaper was found for {reached} ({options}); choose another shaper or tolerance"
            )
        delays = tuple(t / w for t in workspace.factor_delay[:count])
        sequences.append(ImpulseSequence(tuple(workspace.factor_amplitude[:count]), delays, workspace.certificate_left))
    return convolve_all(sequences)


def _options(given: dict[str, float]) -> dict[str, float]:
    """The values given of `OPTIONS`. Raises ArgumentError for an unknown name and a value outside its domain."""
    for name, value in given.items():
        if name not in OPTIONS:
            raise ArgumentError(f"a shaper has no parameter {name!r}.{nearest(name, OPTIONS)}")
        variable = OPTIONS[name]
        _check(name, value, _is_of(variable, value), variable.domain)
    return given


def _is_of(variable: Variable[Any], value: Any) -> bool:
    if not isinstance(value, int | float) or (variable.kind is int and value != int(value)):
        return False
    return variable.problem("", value) is None


def _numbers(name: str, value: Any) -> list[float]:
    """One number or a sequence of them, as floats."""
    try:
        values = [float(value)] if np.ndim(value) == 0 and not isinstance(value, str) else [float(x) for x in value]
    except (TypeError, ValueError):
        values = []
    if not values:
        raise ArgumentError(f"{name} = {value!r}: give a number, or one for each mode")
    return values


def _kind(kind: str | Shaper) -> Shaper:
    names = {item.name: item for item in Shaper if item != Shaper.custom}
    name = kind.name if isinstance(kind, Shaper) else kind
    if not isinstance(name, str) or name not in names:
        raise ArgumentError(f"there is no shaper {name!r}.{nearest(str(name), names)}")
    return names[name]


def _check(name: str, value: float, fine: bool, domain: str) -> None:
    if not fine:
        raise ArgumentError(f"{name} = {value} is outside its domain {domain}")

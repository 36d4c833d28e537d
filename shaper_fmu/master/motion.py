"""Tells from a variable's unit whether it is a velocity or an acceleration."""

from __future__ import annotations

from shaper_fmu.errors import ComponentError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.units import BASE, parse_unit

_ORDERS = {("m", -1): 1, ("m", -2): 2, ("rad", -1): 1, ("rad", -2): 2}
"""Order of a motion by its base unit and the exponent of the second."""


def motion_order(fmu: Fmu, name: str) -> int:
    """2 for an acceleration, 1 for a velocity, of a length or an angle in whatever unit; 0 for all else."""
    found = _exponents(fmu, fmu.unit_of(name) or "")
    time = found.pop("s", 0)
    if list(found.values()) != [1]:
        return 0
    return _ORDERS.get((next(iter(found)), time), 0)


def is_position(fmu: Fmu, name: str) -> bool:
    """Whether a variable is a length or an angle, in whatever unit."""
    return _exponents(fmu, fmu.unit_of(name) or "") in ({"m": 1}, {"rad": 1})


def _exponents(fmu: Fmu, unit: str) -> dict[str, int]:
    """Exponents of base units, as the FMU defines the unit, or as its name says."""
    definition = fmu.unit_definition(unit)
    if definition is not None and definition.baseUnit is not None:
        powers = {str(base): int(getattr(definition.baseUnit, base, 0) or 0) for base in BASE}
        return {base: power for base, power in powers.items() if power}
    plain = unit.replace("^", "").replace("**", "").replace("\u00b2", "2").replace("*", ".").replace(" ", ".")
    try:
        return dict(parse_unit(plain).exponents) if plain else {}
    except ComponentError:
        return {}

"""Unit conversions and transformations, for signals and for parameters.

The standard's order: a value is converted to the target's unit first (unless that is suppressed), and transformed then.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.document_parts import LinearTransformation, Transformation, Unit
from shaper_fmu.units import conversion

Affine = tuple[float, float]
"""Gain and offset: target = gain * source + offset."""

IDENTITY: Affine = (1.0, 0.0)
Scalar = float | int | bool | str


def unit_conversion(source: Unit | None, target: Unit | None) -> Affine:
    """From a value in `source` to one in `target`; identity if one of them is unknown. Raises ModelError if they differ in kind."""
    if source is None or target is None:
        return IDENTITY
    if source.exponents != target.exponents:
        if source.name == target.name:  # the same name, of which one file knows no more
            return IDENTITY
        raise ModelError([f"{source.name} and {target.name} are units of different kinds"])
    return conversion(source, target)


def after(first: Affine, second: Affine) -> Affine:
    """`first`, then `second`."""
    return second[0] * first[0], second[0] * first[1] + second[1]


def applied(affine: Affine, value: Scalar) -> Scalar:
    """A parameter's value, converted; texts, booleans and integers pass only where there is nothing to do."""
    if affine == IDENTITY:
        return value
    if isinstance(value, str | bool):
        raise ModelError([f"{value!r} is not a number, so it cannot be converted to another unit or transformed linearly"])
    return affine[0] * value + affine[1]


def transformed(
    transformation: Transformation | None,
    value: Scalar,
    source_items: Mapping[str, int] | None = None,
    target_items: Mapping[str, int] | None = None,
) -> Scalar:
    """A parameter's value after its transformation. The items of enumerations are needed where names meet numbers.

    Values that a mapping does not name stay as they are. Raises ModelError.
    """
    if transformation is None:
        return value
    if isinstance(transformation, LinearTransformation):
        return applied((transformation.factor, transformation.offset), value)
    table = dict(transformation.entries)
    if transformation.kind == "Boolean":
        text = str(value).lower()
        return table[text] == "true" if text in table else value
    if transformation.kind == "Enumeration":
        name = value if isinstance(value, str) else _name_of(value, source_items)
        return table.get(name, value)
    number = _number_of(value, source_items or target_items)
    return int(table[str(number)]) if str(number) in table else value


def value_table(
    transformation: Transformation | None, values: Sequence[int], source: Mapping[str, int] | None, target: Mapping[str, int] | None
) -> list[int]:
    """The mapping of the values of a boolean (0 and 1), an integer or an enumeration. Raises ModelError."""
    if transformation is None:
        return list(values)
    if isinstance(transformation, LinearTransformation):
        raise ModelError(["a linear transformation is for real numbers only"])
    if transformation.kind == "Boolean":
        table = {int(key == "true"): int(value == "true") for key, value in transformation.entries}
    elif transformation.kind == "Integer":
        table = {int(key): int(value) for key, value in transformation.entries}
    else:
        table = {_item(source, key): _item(target, value) for key, value in transformation.entries}
    return [table.get(value, value) for value in values]


def affine_of(values: Sequence[int], targets: Sequence[int]) -> Affine | None:
    """The gain and offset that take these values to those, None if there are none; exact in whole numbers."""
    pairs = sorted(set(zip(values, targets, strict=True)))
    if all(value == target for value, target in pairs):
        return IDENTITY
    (first, to), (last, upto) = pairs[0], pairs[-1]
    gain = (upto - to) / (last - first) if last != first else 0.0
    offset = to - gain * first
    return (gain, offset) if all(gain * value + offset == target for value, target in pairs) else None


def _name_of(value: Scalar, items: Mapping[str, int] | None) -> str:
    for name, number in (items or {}).items():
        if number == value:
            return name
    raise ModelError([f"{value!r} is the number of no item that is known here, so it cannot be mapped by name"])


def _number_of(value: Scalar, items: Mapping[str, int] | None) -> int:
    if isinstance(value, str):
        if value not in (items or {}):
            raise ModelError([f"{value!r} is not an item whose number is known here, so it cannot be mapped by number"])
        return (items or {})[value]
    return int(value)


def _item(items: Mapping[str, int] | None, name: str) -> int:
    if items is None or name not in items:
        raise ModelError([f"the enumeration has no item {name!r}"])
    return items[name]

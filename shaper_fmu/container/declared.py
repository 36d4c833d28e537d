"""What an FMU's description says and fmpy leaves out: attributes of variables, and texts of arrays."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

from lxml import etree

from shaper_fmu.master.description import declared_root
from shaper_fmu.master.fmu import Fmu


@dataclass(frozen=True)
class DeclaredVariable:
    """The attributes of a variable and of its type, and the values of its Start elements."""

    attributes: dict[str, str] = field(default_factory=dict)
    starts: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Declared:
    """A description: its variables by name."""

    variables: dict[str, DeclaredVariable]

    def variable(self, name: str) -> DeclaredVariable:
        """A variable, or the array that an element of this name is of; nothing declared if there is neither."""
        return self.variables.get(name) or self.variables.get(name.rpartition("[")[0]) or DeclaredVariable()


@functools.lru_cache(maxsize=64)
def declared_of(fmu: Fmu) -> Declared:
    """What an FMU's file declares."""
    root = declared_root((fmu.folder / "modelDescription.xml").read_bytes(), fmu.name)
    variables: dict[str, DeclaredVariable] = {}
    for element in root.iterfind("ModelVariables/*"):
        variables.setdefault(element.get("name") or "", _variable(element))
    return Declared(variables)


def _variable(element: etree._Element) -> DeclaredVariable:
    typed = element[0].attrib if element.tag == "ScalarVariable" and len(element) else {}
    attributes = {str(key): str(text) for key, text in (*element.attrib.items(), *typed.items())}
    return DeclaredVariable(attributes, [start.get("value") or "" for start in element.iterfind("Start")])

"""Names of variables by FMI's naming convention "structured".

The grammar is regular, so that one expression takes microseconds for a name; fmpy's, which is the same as `NAME` by a test, is run
by an Earley parser, in milliseconds.
"""

from __future__ import annotations

import re

from fmpy.model_description import ModelDescription

_NUMBER = "[0-9]+"
_QUOTED = r"""'(?:[A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ "\\\f\n\r\t]|\\')+'"""
_PART = rf"(?:[A-Za-z_][A-Za-z0-9_]*|{_QUOTED})(?:\[{_NUMBER}(?:,{_NUMBER})*\])?"
_IDENTIFIER = rf"{_PART}(?:\.{_PART})*"
NAME = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,{_NUMBER})?\)")
"""Matches a whole name: FMI 2.0.5, section 2.2.9, as fmpy has it."""


def wrong_names(description: ModelDescription) -> list[str]:
    """The names that violate the declared naming convention "structured", by fmpy's messages; none if it is flat."""
    if description.variableNamingConvention == "flat":
        return []
    convention = 'is not a legal variable name for naming convention "structured".'
    wrong = [variable for variable in description.modelVariables if NAME.fullmatch(str(variable.name)) is None]
    return [f'"{variable.name}" (line {variable.sourceline}) {convention}' for variable in wrong]

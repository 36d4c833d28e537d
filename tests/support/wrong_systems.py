"""Wrong systems of all kinds, each with the findings expected: see right_system.py."""

from __future__ import annotations

from right_system import Wrong
from wrong_components import COMPONENTS
from wrong_connections import CONNECTIONS
from wrong_names import NAMES
from wrong_parameters import PARAMETERS

WRONG: dict[str, Wrong] = {**CONNECTIONS, **NAMES, **COMPONENTS, **PARAMETERS}

"""The public class `System`: the master's system, which can also be written as an archive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from shaper_fmu.master import system as master


class System(master.System):
    __doc__ = master.System.__doc__

    def to_ssp(self, path: Path | str, **options: Any) -> Path:
        """Write the system as an SSP archive that other tools run; see `write_system` in ssp/export.py for the options.

        `stop_time`, `step` [s] and `algorithm` become the archive's default experiment.
        """
        from shaper_fmu.ssp.export import write_system

        return write_system(self, path, **options)

    def to_fmu(
        self, path: Path | str, fmi: int = 2, *, expose: Iterable[str] = (), rename: Mapping[str, str] | None = None, **options: Any
    ) -> Path:
        """Write the system as one FMU of FMI 2.0 or 3.0, with all its FMUs and the master's loop inside.

        Free inputs and all outputs are shown as "instance.variable"; `expose` adds parameters and local variables by such names
        ("plant.*" for all of an instance), `rename` gives other names. See `pack` in container/build.py for the options (step,
        algorithm, exact, platforms, name, description, ...). Returns the path. Raises ModelError and BuildError.
        """
        from shaper_fmu.container.build import pack
        from shaper_fmu.container.interface import outer_variables

        return pack(self, outer_variables(self, fmi, expose=expose, rename=rename), path, fmi=fmi, **options).path

"""The public class `System`: the master's system, which can also be written as an archive."""

from __future__ import annotations

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

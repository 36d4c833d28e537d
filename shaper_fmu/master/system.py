"""A system that can be run."""

from __future__ import annotations

from typing import Any

from shaper_fmu.errors import ModelError
from shaper_fmu.master.isolated import simulate_isolated
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.slips import checked_mapping, checked_number


class System(SystemStructure):
    """A system of coupled FMUs.

    Wrong names, types and units raise ModelError where they are given; `check` reports what is missing in the whole.

        system = System("example")
        system.add("shaper", "fmus/InputShaper.fmu", shaper="zvd", natural_frequency=[10.0])
        system.add("plant", "fmus/MassSpringDamper.fmu")
        system.drive("shaper.command", lambda t: 1.0)
        system.connect("shaper.shaped", "plant.force")
        results = system.simulate(stop_time=2.0, step=0.001)
    """

    def simulate(
        self, stop_time: float, step: float, *, isolate: bool = False, time_limit: float | None = None, **options: Any
    ) -> Results:
        """Run the system; see `Simulation` and `Simulation.run` for the options (record, metrics, algorithm, exact, ...).

        With `isolate` it runs in a process of its own, which may crash or hang: that is a SimulationError with the simulated
        time, as is its end after `time_limit` [s] of wall time, from the first call of an FMU on. ModelError for a limit without
        isolation, and for an input's function that cannot be sent to the process (it must be importable from a module).
        """
        checked_number("stop_time", stop_time)
        checked_number("step", step)
        checked_mapping("metrics", options.get("metrics"), '{"left": Residual(output="plant.position", command="shaper.shaped")}')
        if isolate:
            return simulate_isolated(self, stop_time, step, time_limit=time_limit, **options)
        if time_limit is not None:
            raise ModelError([f"time_limit = {time_limit} s needs a process that can be killed: use isolate=True, too"])
        record, metrics = options.pop("record", None), options.pop("metrics", None)
        with Simulation(self, record=record, metrics=metrics, exact=options.get("exact")) as simulation:
            return simulation.run(stop_time, step, **options)

    def __repr__(self) -> str:
        from shaper_fmu.notebook.texts import counted, listed

        wires = counted(len(self.connections) + len(self.clock_connections), "connection")
        return f"<System {self.name!r}: {listed(list(self.fmus)) or 'empty'}; {wires}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.drawing.diagram import MOST_DRAWN
        from shaper_fmu.drawing.svg import svg_of
        from shaper_fmu.master.diagram import diagram_of
        from shaper_fmu.notebook.html import page
        from shaper_fmu.page.blocks import Table

        if not self.fmus:
            return page(f"System {self.name}", {"": "empty; add FMUs with system.add"})
        drawn = svg_of(diagram_of(self)) if len(self.fmus) <= MOST_DRAWN else ""
        rows = [
            [name, fmu.name, f"FMI {fmu.description.fmiVersion}", ", ".join(f"{k} = {v}" for k, v in values.items())]
            for (name, fmu), values in zip(self.fmus.items(), self.start_values.values(), strict=True)
        ]
        return page(f"System {self.name}", {}, [Table("", ["instance", "FMU", "", "start values"], rows, left_aligned=True)], drawn)

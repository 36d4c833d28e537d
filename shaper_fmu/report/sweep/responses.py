"""Time responses of a sweep, simulated again: each case at the nominal values, and in its worst run by each metric."""

from __future__ import annotations

from types import TracebackType

import numpy as np

from shaper_fmu.analysis.response import command_end
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line, label
from shaper_fmu.report.sweep.curves import slug, thinned
from shaper_fmu.report.sweep.data import SweepData
from shaper_fmu.sweep.engine import simulate_run
from shaper_fmu.sweep.runs import Run

MOST_CASES = 12
"""Cases whose responses are drawn."""


class Reruns:
    """Runs of a sweep again, with their trajectories. Use it in a with statement."""

    def __init__(self, data: SweepData, also: list[str]):
        self._data = data
        self._record = list(dict.fromkeys([*data.study.recorded(), *also]))
        self._simulation: Simulation | None = None

    def __enter__(self) -> Reruns:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._close()

    def _close(self) -> None:
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None

    def results(self, run: Run) -> Results | str:
        """The trajectories; or why there are none."""
        if "instances" in self._data.remarks:  # these FMUs need fresh instances for every run
            self._close()
        try:
            if self._simulation is None:
                self._simulation = Simulation(self._data.system, record=self._record)
            return simulate_run(self._simulation, self._data.study, run, self._data.start_time)
        except ShaperFmuError as error:
            self._close()
            return str(error)

    def nominal(self) -> dict[str, Results | str]:
        """Every case at the nominal values, but none that has failed there before: it might take this process with it."""
        data = self._data
        nominal = np.all(data.points == [axis.nominal for axis in data.axes], axis=1)
        found: dict[str, Results | str] = {}
        for i, case in enumerate(data.cases):
            failed = bool(np.any(nominal & (data.case == i) & ~data.done))
            found[case] = "its run with the nominal values failed" if failed else self.results(data.nominal_run(case))
        return found


def worst_index(data: SweepData, metric: str, case: str) -> int | None:
    """The run of a case with the largest metric; None if it has no completed run."""
    indices = np.flatnonzero(data.of(case))
    return int(indices[np.argmax(data.metrics[metric][indices])]) if len(indices) else None


def worst_table(data: SweepData, metric: str) -> Table:
    """The run with the largest metric of each case: where it is, and its metric there."""
    rows = []
    for case in data.cases:
        i = worst_index(data, metric, case)
        if i is None:
            rows.append([case, *["-"] * (len(data.axes) + 2)])
            continue
        values = [f"{a.shown(v)} ({a.deviation(v)})".replace(" ()", "") for a, v in zip(data.axes, data.points[i], strict=True)]
        rows.append([case, data.quantities[metric].shown(data.metrics[metric][i]), *values, str(data.ids[i])])
    head = ["case", "largest", *(axis.name for axis in data.axes), "run"]
    return Table(f"Worst cases: {data.quantities[metric].description}", head, rows)


def response_figure(data: SweepData, output: str, found: dict[str, Results], key: str, title: str) -> Figure:
    """An output of several cases over time, with the end of the last command."""
    unit = next(iter(found.values())).display(output)[1]
    lines = [Line(case, *thinned(r.time, r.display(output)[0]), style=data.cases.index(case)) for case, r in found.items()]
    ends = [command_end(results.time, results[command]) for results in found.values() for command in data.study.commands()]
    marks = [(max(ends), "last command ends")] if ends else []
    return Figure(key, title, "time [s]", label(output, unit), lines, marks=marks)


def response_blocks(data: SweepData, reruns: Reruns, nominal: dict[str, Results | str]) -> list[Block]:
    """Per metric: the table of worst runs, and its output's responses in them; per output: the nominal responses."""
    if not data.done.any():
        return []
    blocks: list[Block] = []
    cases = data.cases[:MOST_CASES]
    if len(cases) < len(data.cases):
        blocks.append(Text(f"Responses of the first {MOST_CASES} of {len(data.cases)} cases."))
    problems = [f"{case}: {result}" for case, result in nominal.items() if isinstance(result, str)]
    shown = {case: nominal[case] for case in cases}
    ready = {case: result for case, result in shown.items() if isinstance(result, Results)}
    for output in dict.fromkeys(measure.output for measure in data.study.metrics.values()):
        if ready:
            title = f"{output} with the nominal values"
            blocks.append(response_figure(data, output, ready, f"response_{slug(output)}_nominal", title))
    for metric, measure in data.study.metrics.items():
        blocks.append(worst_table(data, metric))
        found = {}
        for case in cases:
            i = worst_index(data, metric, case)
            result = reruns.results(data.run(i)) if i is not None else None
            if isinstance(result, Results):
                found[case] = result
            elif result is not None:
                problems.append(f"{case}: {result}")
        if found:
            title = f"{measure.output} in each case's worst run: {data.quantities[metric].description}"
            blocks.append(response_figure(data, measure.output, found, f"response_{metric}_worst", title))
    return [*blocks, *(Text(f"Not shown: {problem}") for problem in problems)]

"""Benchmarks against peers, interleaved in one run; prints a table and writes bench/results.json.

The peer of `master_vs_fmpy_loop` is what a user would write with fmpy alone: set, doStep and get of each FMU, in
Python. Both couple the same three FMUs, and their results are compared before their times are.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

from shaper_fmu import System, build_fmu, find_component
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.simulation import Simulation

REPETITIONS = 7
STEPS, STEP = 2000, 0.001


def interleaved(ours: Callable[[], float], peer: Callable[[], float]) -> tuple[float, float]:
    """Median seconds of both, called in turn; the functions return what has to be equal."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(REPETITIONS):
        values = []
        for function, taken in zip((ours, peer), times, strict=True):
            begin = time.perf_counter()
            values.append(function())
            taken.append(time.perf_counter() - begin)
        if abs(values[0] - values[1]) > 1e-12:
            raise SystemExit(f"results differ: {values}")
    return median(times[0]), median(times[1])


def master_vs_fmpy_loop(fmus: Path) -> tuple[float, float]:
    """Microseconds per macro step of profile -> shaper -> plant, Jacobi without order, all FMUs by pythonfmu."""
    starts = {"profile": {"profile": 3, "duration": 1.0}, "shaper": {"shaper": 2}, "plant": {}}
    files = {"profile": "MotionProfile", "shaper": "InputShaper", "plant": "MassSpringDamper"}
    system = System("chain")
    for name, file in files.items():
        system.add(name, fmus / f"{file}.fmu", starts[name])
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    loaded = {name: load_fmu(fmus / f"{file}.fmu") for name, file in files.items()}
    reference = {(n, v.name): v.valueReference for n, fmu in loaded.items() for v in fmu.variables.values()}
    instances = {name: Instance(name, fmu) for name, fmu in loaded.items()}

    def peer() -> float:
        slaves = {name: instance.slave for name, instance in instances.items()}
        for name, instance in instances.items():
            slaves[name].reset()
            instance.set_values(starts[name])
            for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
                instance.call(call)
        profile, shaper, plant = slaves.values()
        position, shaped, swing = [0.0], [0.0], [0.0]
        for i in range(STEPS):
            shaper.setReal([reference["shaper", "command"]], position)
            plant.setReal([reference["plant", "force"]], shaped)
            for slave in (profile, shaper, plant):
                slave.doStep(i * STEP, STEP)
            position = profile.getReal([reference["profile", "position"]])
            shaped = shaper.getReal([reference["shaper", "shaped"]])
            swing = plant.getReal([reference["plant", "position"]])
        return swing[0]

    with Simulation(system, record=["plant.position"]) as simulation:

        def ours() -> float:
            return simulation.run(STEPS * STEP, STEP, algorithm="parallel")["plant.position"][-1]

        times = interleaved(ours, peer)
    for instance in instances.values():
        instance.close()
    return times[0] / STEPS * 1e6, times[1] / STEPS * 1e6


def main() -> None:
    """Run all pairs."""
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in ("InputShaper", "MotionProfile", "MassSpringDamper"):
            build_fmu(find_component(name), folder)
        for pair in (master_vs_fmpy_loop,):
            ours, peer = pair(Path(folder))
            results[pair.__name__] = {"ours": ours, "peer": peer, "unit": "us", "ratio": peer / ours}
    table = Table("pair", "ours", "peer", "unit", "peer / ours")
    for name, row in results.items():
        table.add_row(name, f"{row['ours']:.2f}", f"{row['peer']:.2f}", row["unit"], f"{row['ratio']:.2f}")
    Console().print(table)
    (Path(__file__).parent / "results.json").write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()

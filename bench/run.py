"""Benchmarks against peers, interleaved in one run; prints a table and writes bench/results.json. See docs/benchmarks.md."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path

from bare_calls import loop_vs_bare_calls
from choice import CHOICES
from containers import container_vs_loop
from first_run import first_run
from harness import REPETITIONS, Row
from live import LIVE
from masters import MASTERS
from model_exchange import me_vs_fmpy
from native import (
    native_fmi3_vs_fmi2,
    native_set_step_get,
    native_vs_handwritten_c,
    native_vs_pythonfmu,
    native_vs_pythonfmu_at_its_best,
    native_vs_pythonfmu_input_shaper,
)
from rich import box
from rich.console import Console
from rich.table import Table
from sweep import SWEEPS
from tune import tune_two_modes

PAIRS = (
    loop_vs_bare_calls,
    first_run,
    container_vs_loop,
    me_vs_fmpy,
    native_vs_pythonfmu,
    native_vs_pythonfmu_at_its_best,
    native_vs_pythonfmu_input_shaper,
    native_vs_handwritten_c,
    native_fmi3_vs_fmi2,
    tune_two_modes,
    *CHOICES,
    *LIVE,
)


def measured(folder: Path, console: Console) -> list[Row]:
    """All rows; FMUs are built into `folder`."""
    rows = []
    with console.status("") as status:
        for pair in (*MASTERS, *SWEEPS, *PAIRS):
            status.update(pair.__name__)
            rows.append(pair(folder))
        status.update(native_set_step_get.__name__)
        return rows + native_set_step_get(folder)


def number(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:#.3g}"


def table(rows: list[Row]) -> Table:
    """The rows to look at."""
    caption = f"Medians of {REPETITIONS} repetitions, in turn with the peer. Ratio: peer / ours."
    shown = Table(title="Microseconds per step", caption=caption, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    shown.add_column("benchmark", overflow="fold")
    for heading in ("ours", "peer", "ratio", "needed"):
        shown.add_column(heading, justify="right")
    for row in rows:
        name = row.name + (f"\n[dim]{row.note}[/dim]" if row.note else "")
        peer, ratio, needed = (number(value) if value else "" for value in (row.peer, row.ratio, row.needed))
        if row.ratio and row.needed:
            ratio = f"[{'green' if row.ratio >= row.needed else 'red'}]{ratio}[/]"
        shown.add_row(name, number(row.ours), peer, ratio, needed)
    return shown


def main() -> None:
    """Measure everything."""
    console = Console()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        rows = measured(Path(folder), console)
    console.print(table(rows))
    console.print(f"{time.perf_counter() - begin:.0f} s")
    results = {row.name: row.entry for row in rows}
    (Path(__file__).parent / "results.json").write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()

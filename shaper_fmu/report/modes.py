"""Reports of a mode selection: all sets of modes, the chosen one, its impulses and its response."""

from __future__ import annotations

from typing import Any

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.modal_responses import ModalResponse
from shaper_fmu.design.mode_selection import ModeSet, Selection, mode_sets
from shaper_fmu.errors import ComponentError
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line

BANDS = (0.05, 0.02)
_SHOWN_SETS = 64
_POINTS = 1001


def mode_blocks(response: ModalResponse, selection: Selection, kind: str, **options: Any) -> list[Block]:
    """Blocks of the page: the modes, all their sets with shapers of one `kind`, the selection, and its response."""
    return [
        modes_table(response),
        *_sets(response, selection, kind, **options),
        Text(f"Chosen, {selection.reason}."),
        impulses_table(selection.chosen.shaper),
        *response_figures(response, {"no shaper": ImpulseSequence((1.0,), (0.0,)), "chosen": selection.chosen.shaper}),
    ]


def modes_table(response: ModalResponse) -> Table:
    """The modes that can be shaped, numbered like in the table of sets, with the largest share of theirs in any output."""
    shares = (np.abs(response.residues) / np.abs(response.final)[:, None]).max(axis=0)
    rows = [
        [str(k), f"{w:.7g}", f"{w / (2.0 * np.pi):.4g}", f"{response.damping_ratio[k]:.7g}", f"{shares[k]:.4g}"]
        for k, w in ((k, response.natural_frequency[k]) for k in response.modes)
    ]
    return Table("Modes", ["mode", "natural frequency [rad/s]", "[Hz]", "damping ratio", "largest share"], rows)


def sets_table(response: ModalResponse, sets: list[ModeSet], chosen: ModeSet | None = None) -> Table:
    """Duration D, residual rho and settling times of each set, of the slowest output; `chosen` is marked."""
    rows = []
    for one in sets:
        times = [response.settling_time(one.shaper, band).max() for band in BANDS]
        same = chosen is not None and (one.modes, one.kinds) == (chosen.modes, chosen.kinds)
        residual = one.residual if one.residual > 1e-12 else 0.0
        rows.append(
            [set_name(one) + (" *" if same else ""), f"{one.duration:.5f}", f"{residual:.6f}", *(f"{t:.4f}" for t in times)]
        )
    head = ["modes", "D [s]", "rho", *(f"settled to {band:.0%} [s]" for band in BANDS)]
    return Table("Sets of modes", head, rows)


def set_name(one: ModeSet) -> str:
    """A set as {0, 2}."""
    return "{" + ", ".join(map(str, one.modes)) + "}"


def impulses_table(sequence: ImpulseSequence, digits: int = 10) -> Table:
    """The impulses of a shaper."""
    levels = np.cumsum(sequence.amplitudes)
    rows = [
        [str(i + 1), f"{t:.{digits}g}", f"{a:.{digits}f}", f"{level:.{digits}f}"]
        for i, (t, a, level) in enumerate(zip(sequence.delays, sequence.amplitudes, levels, strict=True))
    ]
    return Table("Impulses", ["impulse", "delay [s]", "amplitude", "level of a step"], rows)


def response_figures(response: ModalResponse, shapers: dict[str, ImpulseSequence]) -> list[Figure]:
    """A figure of each output's response to a unit step through each of the shapers."""
    end = 1.3 * max(float(response.settling_time(one, 0.02).max()) for one in shapers.values())
    time = np.linspace(0.0, end or 1.0, _POINTS)
    values = {name: response.values(one, time) for name, one in shapers.items()}
    return [
        Figure(
            f"response_{j + 1}", f"Response of {output} to a unit step", "time [s]", output,
            [Line(name, time, found[j]) for name, found in values.items()],
        )
        for j, output in enumerate(response.names)
    ]  # fmt: skip


def _sets(response: ModalResponse, selection: Selection, kind: str, **options: Any) -> list[Block]:
    try:
        sets = mode_sets(response, kind, **options)
    except ComponentError as error:
        return [Text(f"Sets of modes are not shown: {error}.")]
    if len(sets) <= _SHOWN_SETS:
        return [sets_table(response, sets, selection.chosen)]
    least = sorted(sets, key=lambda one: one.residual)[:_SHOWN_SETS]
    shown = sets_table(response, [one for one in sets if one in least], selection.chosen)
    return [Table(f"{shown.title} (of {len(sets)}, those with the least residual)", shown.head, shown.rows)]

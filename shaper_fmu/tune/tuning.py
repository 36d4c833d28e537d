"""The result of a tuning: the modes of a plant, a shaper for them, and its verification."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from shaper_fmu.analysis.identification import CONTRADICTING, Finding
from shaper_fmu.errors import ArgumentError, nearest
from shaper_fmu.renamed import warn_renamed
from shaper_fmu.slips import checked_mapping, checked_names, checked_number, checked_numbers
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.range import PlantModes
from shaper_fmu.tune.meter import Effort, Part
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.move import MoveCommand
from shaper_fmu.tune.verification.responses import Responses
from shaper_fmu.tune.verification.verify import Verification

Verdict = Literal["tuned", "for_modes_found", "no_vibration", "unstable", "nothing_fits", "not_held", "not_verified", "not_proven"]
"""tuned: the recommended shaper holds on the plant; for_modes_found: from measured data, so that its bound holds for the modes
found there, and there is no plant to try it on;
no_vibration, unstable: there is nothing to shape, or nothing that shaping could help; nothing_fits: see `Choice.nearest`; not_held:
on the plant the shaper leaves more than the tolerance; not_verified: no output settles, so that nothing could be compared;
not_verified, too, if the budget left points or the verification out;
not_proven: findings contradict the modes, or the absence of modes."""

GOOD: tuple[Verdict, ...] = ("tuned", "for_modes_found", "no_vibration")
"""Verdicts after which nothing more is to be done."""

CAVEATS: Mapping[Verdict, str] = {
    "not_proven": "NOT PROVEN: findings contradict the modes that this shaper is for",
    "not_held": "NOT HELD: on the plant this shaper leaves more than was asked for, or could not be shown to keep it everywhere",
    "not_verified": "NOT VERIFIED: this shaper could not be tried on the plant",
}
"""The caveat in every file of a shaper whose verdict is not good."""

AGAINST_NO_VIBRATION = (*CONTRADICTING, "nonlinear", "no_rest", "coupling", "failed", "lost", "modes_differ")
"""Findings of experiments with which nobody can say that a plant does not vibrate."""

UNKNOWN_MARGIN = 0.1
"""Of the natural frequencies, if no parameter varies."""

Say = Callable[[str], None]
"""Called with a text on the next step of the work."""


@dataclass(frozen=True, repr=False)
class Tuning:
    """The result of a tuning.

    Attributes:
        verdict: see `Verdict`.
        summary: the result in a few sentences.
        source: the plant's or the file's name.
        input, input_unit: the plant's input and its unit; "" for measured data.
        command: of the verification; a move, if the requirements have one.
        outputs: names.
        spread: parameters of the plant and the share by which each varies.
        system: the plant, to be wired with a shaper; None for measured data.
        plant: what experiments have shown; None for measured data.
        measured: what measured data have shown; None for a plant.
        choice: None where there is nothing to choose.
        verification: None where there is no plant, or nothing could be compared.
        responses: of the plant to a step, shaped and unshaped, nominal and worst.
        findings: what the user should know.
        efforts: what each part of the work on a plant has cost: steps, runs and time; {} for measured data.
    """

    verdict: Verdict
    summary: str
    source: str
    input: str
    input_unit: str
    command: Command | MoveCommand
    outputs: tuple[str, ...]
    spread: Mapping[str, float]
    system: Plant | None
    plant: PlantModes | None
    measured: MeasuredIdentification | None
    choice: Choice | None
    verification: Verification | None
    responses: tuple[Responses, ...]
    findings: tuple[Finding, ...]
    efforts: Mapping[Part, Effort] = field(default_factory=dict, compare=False)

    @property
    def words(self) -> str:
        """The old name of `summary`."""
        warn_renamed("Tuning.words", "summary")
        return self.summary

    @property
    def candidate(self) -> Candidate | None:
        """The shaper that is recommended, or else the nearest one."""
        return self.choice.nearest if self.choice is not None else None

    @property
    def good(self) -> bool:
        """Whether nothing more is to be done."""
        return self.verdict in GOOD

    @property
    def caveat(self) -> str:
        """The caveat in the files of the shaper; "" with a good verdict, and without a shaper."""
        return CAVEATS.get(self.verdict, "") if self.choice is not None and self.choice.recommended is not None else ""

    def plot(self, axes: Any = None) -> Any:
        """Draw the outputs after the command, unshaped and shaped, in the worst case; see `Results.plot`.

        Raises ArgumentError where the shaper was not tried on a plant: then `tuning.choice.plot()` shows the choice.
        """
        from shaper_fmu.notebook.plots import plot
        from shaper_fmu.tune.shown import response_figures

        figures = response_figures(self)
        if not figures:
            hint = "; tuning.choice.plot() shows the choice" if self.choice is not None else ""
            raise ArgumentError(f"there is no response to plot, since no shaper was tried on a plant ({self.verdict}){hint}")
        return plot(figures, axes)

    def __repr__(self) -> str:
        from shaper_fmu.tune.shown import tuning_text

        return f"<Tuning: {tuning_text(self)}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.tune.choice.shown import front_table, modes_table
        from shaper_fmu.tune.shown import tuning_facts

        tables = [modes_table(self.choice), front_table(self.choice)] if self.choice is not None else []
        return page(f"Tuning of {self.source}", tuning_facts(self), tables)


def check_options(options: Mapping[str, Any], known: Callable[..., Any]) -> None:
    """Raise ArgumentError for an option that `known` does not have; of a requirement it tells where it belongs."""
    names = inspect.signature(known).parameters
    for name in options:
        if name in (one.name for one in fields(Requirements)):
            raise ArgumentError(f"{name} is a requirement: give requirements=requirements_for(spread, {name}=...)")
        if name not in names:
            raise ArgumentError(f"tuning has no option {name!r}.{nearest(name, names)}")


def requirements_for(spread: Mapping[str, float], **wanted: Any) -> Requirements:
    """`Requirements` with 1 % nominally, and with a margin of the frequencies if no parameter varies."""
    checked_mapping("spread", spread, '{"mass": 0.1} for 10 %')
    for name, share in spread.items():
        checked_number(f"spread of {name}", share)
    known = [one.name for one in fields(Requirements)]
    for name, value in wanted.items():
        if name not in known:
            raise ArgumentError(f"a requirement {name!r} is not known.{nearest(name, known)}")
        checked_names(name, value) if name == "kinds" else checked_numbers(name, value)
    margin = 0.0 if any(spread.values()) else UNKNOWN_MARGIN
    tolerance = wanted.get("tolerance", Requirements.tolerance)
    return Requirements(**{"nominal_tolerance": min(0.01, tolerance), "frequency_margin": margin, **wanted})

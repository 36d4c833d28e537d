"""What a tuning shows of itself at the prompt and in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shaper_fmu.notebook.texts import percent
from shaper_fmu.page.figures import UNSHAPED_AND_SHAPED, Figure, Line, label
from shaper_fmu.tune.choice.shown import candidate_text

if TYPE_CHECKING:
    from shaper_fmu.tune.tuning import Tuning


def tuning_text(tuning: Tuning) -> str:
    """A tuning in one line."""
    what = f"{tuning.source}, {tuning.input} -> {', '.join(tuning.outputs)}" if tuning.input else tuning.source
    best = f": {candidate_text(tuning.candidate)}" if tuning.candidate is not None else ""
    return f"{tuning.verdict.replace('_', ' ')}, {what}{best}"


def tuning_facts(tuning: Tuning) -> dict[str, str]:
    """The facts of a tuning."""
    unit = f" [{tuning.input_unit}]" if tuning.input_unit else ""
    verified = tuning.verification
    return {
        "verdict": tuning.verdict.replace("_", " "),
        "result": tuning.summary,
        "caveat": tuning.caveat,
        "input": f"{tuning.input}{unit}" if tuning.input else "",
        "outputs": ", ".join(tuning.outputs),
        "varied": ", ".join(f"{name} by {percent(share)}" for name, share in tuning.spread.items()),
        "on the plant": verified.reason if verified is not None else "not tried",
        "findings": "; ".join(one.text for one in tuning.findings),
    }


def response_figures(tuning: Tuning) -> list[Figure]:
    """Each output after the command, unshaped and shaped, in the last of the responses: the worst case, where there is one."""
    if not tuning.responses:
        return []
    shown = tuning.responses[-1]
    values = ", ".join(f"{name} = {value:.4g}" for name, value in shown.values.items())
    figures = []
    for name, (unshaped, shaped) in shown.outputs.items():
        before, after = UNSHAPED_AND_SHAPED
        lines = [Line("unshaped", shown.time, unshaped, style=before), Line("shaped", shown.time, shaped, style=after)]
        title = f"{name}, {shown.case}{f': {values}' if values else ''}"
        figures.append(Figure(f"response_{name}", title, "time [s]", label(name, shown.units[name]), lines))
    return figures

"""Blocks on what the paper leaves for later: other methods beside the command, and errors in the damping."""

from __future__ import annotations

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line, Map
from shaper_fmu.reproduce.runs import band_below
from shaper_fmu.reproduce.two_part.claims import band_text
from shaper_fmu.reproduce.two_part.compared import LONGER
from shaper_fmu.reproduce.two_part.runs import COMMANDS, DAMPING_RATIO, DURATION
from shaper_fmu.reproduce.two_part.study import DAMPINGS, LEVEL, MAP_DAMPINGS, MAP_RATIOS, Study

PLANT = "actual over designed natural frequency"
_LEVELS = [(100 * LEVEL, "5 %")]


def compared_table(study: Study) -> Table:
    """The methods that the papers name, in the paper's time and in 1.5 periods."""
    rows = []
    for name, found in study.compared.items():
        cells = []
        for duration in (DURATION, LONGER):
            one = found.get(duration)
            if one is None:
                cells += ["-", "needs more than a period"]
            else:
                cells += [f"{100 * one.nominal:.2f}", band_text(one.band) if one.band else "none"]
        rows.append([name, *cells])
    times = [f"{DURATION:g} s", "1.5 periods"]
    head = ["method", *(text for time in times for text in (f"V [%] in {time}", f"V below 5 % of w*/w in {time}"))]
    return Table("Other methods, designed for a wrong estimate w*", head, rows)


def damping_blocks(study: Study) -> list[Block]:
    """What a wrong damping leaves: over the pendulum's, over the one that the command is designed for, and by formula."""
    lines = [Line(f"{name}, over the pendulum's", DAMPINGS, 100 * curve) for name, curve in study.damping.items()]
    lines += [Line(f"{name}, over the one it is designed for", DAMPINGS, 100 * curve) for name, curve in study.believed.items()]
    panels = [(name, 100 * values) for name, values in study.maps.items()]
    return [
        Text(
            "What the paper leaves for later: errors in the damping. A command designed for zeta* leaves on a pendulum with zeta "
            "V = 2 |zeta* - zeta| / (w T) exp(-zeta w T) |1 - exp(-q)| / |1 + (q / (2 pi n))^2|, with q = w T (-zeta + j sqrt(1 - "
            "zeta^2)) and n parts, 1 or 2: it is proportional to the error of the damping for which it is designed. The two-part "
            "command leaves |1 + (q / 2 pi)^2| / |1 + (q / 4 pi)^2| of what the single one does, 0.34 in 0.85 periods and more "
            "than 1 from sqrt(8/5) = 1.265 periods on. The same factor holds for small errors of the frequency."
        ),
        _bands(study),
        Figure(
            "damping",
            "Wrong damping at the designed frequency",
            "damping ratio of the pendulum, or for which the command is designed",
            "V [%]",
            lines,
            _LEVELS,
            [(DAMPING_RATIO, "right")],
        ),
        Map(
            "damping_map",
            "Wrong frequency and damping",
            PLANT,
            "actual damping ratio",
            "V [%]",
            MAP_RATIOS,
            MAP_DAMPINGS,
            panels,
            [*_LEVELS, (10.0, "10 %"), (20.0, "20 %")],
            points=[(1.0, DAMPING_RATIO)],
        ),
    ]


def _bands(study: Study) -> Table:
    rows = []
    double = len(DAMPINGS) // 2
    for name in COMMANDS:
        for what, curve in (("of the pendulum", study.damping[name]), ("designed for", study.believed[name])):
            low, high = band_below(DAMPINGS, curve, LEVEL, DAMPING_RATIO)
            rows.append([f"{name}, {what}", f"{100 * curve[0]:.2f}", f"{100 * curve[double]:.2f}", f"{low:.3f} to {high:.3f}"])
    return Table("V [%] by the damping ratio", ["damping ratio", "none", "twice", "V below 5 %"], rows)

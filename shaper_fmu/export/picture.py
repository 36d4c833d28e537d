"""A picture of a component's behaviour: its outputs over time, as SVG for the documentation page.

The plain Python component runs with its start values, and its inputs step once. matplotlib draws; it is optional, and
without it there is no picture. Equal sources, and an equal matplotlib, give equal bytes.
"""

from __future__ import annotations

import enum
import functools
import io
import math
import threading
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from shaper_fmu.component import NO_EVENT, Component, Variable
from shaper_fmu.page.figures import COLOURS, label
from shaper_fmu.units import conversion, parse_unit

INTERVALS = 400
STEP_AT = INTERVALS // 20
"""Number of the interval at whose start the inputs step: at 5 % of the time."""

_SIZES = (0.5, 0.1, 0.01)  # of the first input's step; smaller ones are tried where the component refuses a larger one
_MOST_EVENTS = 400
_MOST_REVERSALS = 24
_LINES = (("-", 2.4), ("--", 1.7), ("-.", 1.3), (":", 1.3))  # style and width: one can be seen on top of another
_TRUTH = "true or false"
_SVG = "{http://www.w3.org/2000/svg}"


@dataclass
class Recording:
    """One run of a component. `series` has a list of values for each label, as long as `times` [s]."""

    span: float
    steps: dict[str, float]
    times: list[float] = field(default_factory=list)
    series: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Picture:
    """An SVG element as text, and its caption."""

    svg: str
    caption: str


_ONE_STYLE = threading.Lock()
"""matplotlib's style is one for the process: pictures of two threads would leave each other's behind."""


def behaviour_picture(component: type[Component]) -> Picture | None:
    """The outputs of the component over time; None without matplotlib, or where nothing can be run or seen."""
    recording = _drawable_recording(component)
    if recording is None:
        return None
    panels = _panels(component, recording)
    return Picture(_draw(component, recording, panels), _caption(component, recording)) if panels else None


def behaviour_icon(component: type[Component]) -> dict[str, bytes]:
    """The component's name under the curve of its first real output, "png" of 200 by 200 points and "svg"; {} without a picture."""
    recording = _drawable_recording(component)
    panels = _panels(component, recording) if recording is not None else {}
    shown = [v.scalar_names[0] for panel in panels.values() for v in panel if v.causality == "output" and v.kind is float]
    if recording is None or not shown:
        return {}
    return {"png": _draw_icon(component, recording, shown[0], "png"), "svg": _draw_icon(component, recording, shown[0], "svg")}


def _drawable_recording(component: type[Component]) -> Recording | None:
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return None
    return _telling_recording(component)


@functools.lru_cache(maxsize=1)  # one run for the picture and the icon
def _telling_recording(component: type[Component]) -> Recording | None:
    """A run over a time in which there is something to see, with the largest steps that the component accepts."""
    for size in _SIZES:
        try:
            span = component.default_stop_time
            for _ in range(8):
                recording = record(component, span, size)
                shorter = _interesting_span(component, recording)
                if shorter >= span:
                    return recording
                span = shorter
            return record(component, span, size)
        except Exception:  # whatever a kernel raises: a page without a picture is better than no page
            continue
    return None


def record(component: type[Component], span: float, size: float) -> Recording:
    """Run from 0 to `span` [s] in equal steps, and to each announced event, where values from both sides are taken.

    The first input steps by `size`, each further one by half of the one before, so that they do not cancel each other.
    The run ends early after too many events. Raises what the kernels raise.
    """
    instance = component()
    instance.initialize(0.0)
    steps = _step_sizes(component, size)
    outputs = [v for v in component.variables.values() if v.causality in ("input", "output") and v.name != "next_event_time"]
    recording = Recording(span, steps, series={name: [] for v in outputs for name in v.scalar_names})

    def sample(time: float) -> None:
        recording.times.append(time)
        for variable in outputs:
            value = getattr(instance, variable.name)
            for name, element in zip(variable.scalar_names, [value] if variable.size is None else value, strict=True):
                recording.series[name].append(float(element))

    sample(0.0)
    time, events = 0.0, 0
    for k in range(INTERVALS):
        if k == STEP_AT:
            for name, value in steps.items():
                instance.set(name, value)
            instance.do_step(time, 0.0)
            sample(time)
        end = (k + 1) * span / INTERVALS
        while time < (event := getattr(instance, "next_event_time", NO_EVENT)) <= end:
            instance.do_step(time, event - time, left_limits=True)
            sample(event)
            instance.do_step(event, 0.0)
            sample(event)
            time, events = event, events + 1
            if events == _MOST_EVENTS:
                recording.span = time
                return recording
        if time < end:
            instance.do_step(time, end - time)
            sample(end)
        time = end
    return recording


def _step_sizes(component: type[Component], size: float) -> dict[str, float]:
    """The step of each scalar input; an input that cannot take the value stays as it is."""
    steps: dict[str, float] = {}
    inputs = [v for v in component.variables.values() if v.causality == "input" and not issubclass(v.kind, enum.IntEnum)]
    for i, variable in enumerate(inputs):
        for name, start in zip(variable.scalar_names, variable.starts, strict=True):
            value = start + size * 0.5**i if variable.kind is float else variable.kind(1)
            if variable.problem(name, value) is None:
                steps[name] = value
    return steps


def _interesting_span(component: type[Component], recording: Recording) -> float:
    """The time [s] until the outputs rest, or have gone up and down often enough."""
    shown = [n for v in component.variables.values() if v.causality == "output" for n in v.scalar_names if n in recording.series]
    busy = [_rest_time(recording.times, recording.series[name]) for name in shown]
    crowded = [_crowded_time(recording.times, recording.series[name]) for name in shown]
    rest = max(busy, default=0.0)
    jump = recording.times[STEP_AT] if recording.steps else 0.0
    span = _round_up(1.2 * rest) if jump < rest < 0.5 * recording.span else recording.span
    return min([recording.span, span, *(_round_up(time) for time in crowded if time < 0.8 * recording.span)])


def _rest_time(times: list[float], values: list[float]) -> float:
    """When the values have come within 2 % of their range of the last one for good; 0 if they never move."""
    band = 0.02 * (max(values) - min(values))
    return next((t for t, value in zip(reversed(times), reversed(values), strict=True) if abs(value - values[-1]) > band), 0.0)


def _crowded_time(times: list[float], values: list[float]) -> float:
    """When the values have turned round _MOST_REVERSALS times, each by more than a tenth of their range; infinite if never."""
    least = 0.1 * (max(values) - min(values))
    turn, direction, reversals = values[0], 0, 0
    for time, value in zip(times, values, strict=True):
        if (value - turn) * direction > 0.0:
            turn = value
        elif abs(value - turn) > least:
            turn, direction, reversals = value, (1 if value > turn else -1), reversals + 1
            if reversals > _MOST_REVERSALS:
                return time
    return math.inf


def _round_up(time: float) -> float:
    """The next larger time with a round number."""
    scale = 10.0 ** math.floor(math.log10(time))
    return next(step * scale for step in (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0) if step * scale >= time * 0.999)


def _panels(component: type[Component], recording: Recording) -> dict[str, list[Variable[Any]]]:
    """Outputs by the unit in which they are shown, truth being one, with inputs of the same unit at the end."""
    panels: dict[str, list[Variable[Any]]] = {}
    for causality in ("output", "input"):
        for variable in component.variables.values():
            found = [name in recording.series and max(map(abs, recording.series[name])) < 1e100 for name in variable.scalar_names]
            unit = _TRUTH if variable.kind is bool else variable.display_unit or variable.unit
            if variable.causality == causality and all(found) and (causality == "output" or unit in panels):
                panels.setdefault(unit, []).append(variable)
    return panels


def _caption(component: type[Component], recording: Recording) -> str:
    text = f"What {component.__name__} does with the start values of its parameters"
    end = ". The run stops at each event, so that jumps are where they belong." if "next_event_time" in component.variables else "."
    if not recording.steps:
        return text + end
    steps = []
    for variable in component.variables.values():
        for name in variable.scalar_names:
            if variable.causality == "input" and name in recording.steps:
                steps.append(f"{name} to {recording.steps[name]:g} {variable.unit}".strip())
    return f"{text}, when at {recording.span * STEP_AT / INTERVALS:g} s its inputs step: {', '.join(steps)}{end}"


def _draw(component: type[Component], recording: Recording, panels: dict[str, list[Variable[Any]]]) -> str:
    import matplotlib.style
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    look = {
        "svg.hashsalt": component.__name__, "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9.0,
        "axes.spines.top": False, "axes.spines.right": False, "axes.formatter.useoffset": False,
    }  # fmt: skip
    heights = [0.5 if unit == _TRUTH else 1.0 for unit in panels]
    stream = io.BytesIO()
    with _ONE_STYLE, matplotlib.style.context(["default", look]):
        figure = Figure(figsize=(7.5, 0.8 + 1.5 * sum(heights)), layout="constrained")
        figure.suptitle(f"{component.__name__}: outputs over time")
        rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for axes, (unit, variables) in zip(rows, panels.items(), strict=True):
            _draw_panel(axes, unit, variables, recording)
        rows[-1].set_xlabel(label("time", "s"))
        rows[-1].set_xlim(0.0, recording.span)
        figure.align_ylabels()
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})  # Figure.savefig draws twice
    return _inline(stream.getvalue(), f"{component.__name__}: outputs over time")


def _draw_icon(component: type[Component], recording: Recording, name: str, kind: str) -> bytes:
    import matplotlib.style
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    look = {
        "svg.hashsalt": component.__name__,
        "svg.fonttype": "none",
        "font.family": "sans-serif",
        "lines.solid_joinstyle": "round",
    }
    stream = io.BytesIO()
    with _ONE_STYLE, matplotlib.style.context(["default", look]):
        figure = Figure(figsize=(2.0, 2.0), dpi=100.0)
        figure.add_artist(Rectangle((0.02, 0.02), 0.96, 0.96, facecolor="white", edgecolor="#333333", linewidth=1.5, zorder=-1.0))
        axes = figure.add_axes((0.12, 0.3, 0.76, 0.58))
        axes.axhline(0.0, color="#cccccc", linewidth=1.0)
        axes.plot(recording.times, recording.series[name], color=COLOURS[0], linewidth=2.2)
        axes.set_xlim(0.0, recording.span)
        axes.set_axis_off()
        size = min(12.0, 200.0 / max(1, len(component.__name__)))
        figure.text(0.5, 0.15, component.__name__, ha="center", va="center", fontsize=size, color="#222222")
        nothing = {"Software": None} if kind == "png" else {"Date": None}
        figure.savefig(stream, format=kind, transparent=True, metadata=nothing)
    return stream.getvalue() if kind == "png" else _inline(stream.getvalue(), component.__name__).encode()


def _draw_panel(axes: object, unit: str, variables: list[Variable[Any]], recording: Recording) -> None:
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
    alone = sum(len(v.scalar_names) for v in variables if v.causality == "output") == 1
    count = 0
    for variable in variables:
        factor = conversion(parse_unit(variable.unit), parse_unit(variable.display_unit))[0] if variable.display_unit else 1.0
        drawstyle = "default" if variable.kind is float else "steps-post"
        for name in variable.scalar_names:
            values = [factor * value for value in recording.series[name]]
            if variable.causality == "input":
                axes.plot(recording.times, values, ":", color="#555555", linewidth=1.1, label=f"{name} (input)")
            else:
                style, width = ("-", 1.5) if alone else _LINES[count % len(_LINES)]
                colour = COLOURS[count % len(COLOURS)]
                axes.plot(recording.times, values, style, color=colour, linewidth=width, drawstyle=drawstyle, label=name)
                count += 1
    axes.margins(y=0.12)
    axes.grid(True, linewidth=0.4, color="#cccccc")
    if unit == _TRUTH:
        axes.set_ylim(-0.15, 1.15)
        axes.set_yticks([0.0, 1.0], ["false", "true"])
    else:
        axes.set_ylabel(f"[{unit}]" if unit else "no unit")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize=8.5)


def _inline(svg: bytes, title: str) -> str:
    """The SVG element alone, as wide as the page, without the tool's version."""
    root = etree.fromstring(svg)
    for element in root.findall(f"{_SVG}metadata"):
        root.remove(element)
    for attribute in ("width", "height"):
        root.attrib.pop(attribute, None)
    root.set("role", "img")
    heading = etree.Element(f"{_SVG}title")
    heading.text = title
    root.insert(0, heading)
    return etree.tostring(root, encoding="unicode")

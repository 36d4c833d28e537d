"""Draws figures for the page with plotly."""

from __future__ import annotations

import html
import math
import textwrap

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from shaper_fmu.page.figures import Figure, Map

_TITLE = 32
"""Letters in a line of a panel's title."""

_BELOW = {"orientation": "h", "yanchor": "top", "y": -0.2, "xanchor": "left", "x": 0.0}
"""A legend beside the curves would leave no room for them on a narrow page."""


def plotly_script() -> str:
    """plotly's JavaScript, to be put into the page once."""
    return get_plotlyjs()


def interactive(figure: Figure) -> str:
    """The figure without its title as an HTML element, for a page that holds `plotly_script`."""
    drawn = go.Figure()
    for line, (colour, dash), symbol in zip(figure.lines, figure.styles(), figure.symbols(), strict=True):
        style = {"color": colour, "dash": dash, "width": 2}
        mode = ("lines+markers" if line.markers else "lines") if line.joined else "markers"
        marker = {"color": colour, "symbol": symbol, "size": 6 if line.joined else 11 if len(line.x) == 1 else 4}
        trace = go.Scatter(x=line.x.tolist(), y=line.y.tolist(), name=_escaped(line.name), mode=mode, line=style, marker=marker)
        drawn.add_trace(trace.update(yaxis="y2") if line.right else trace)
    for value, text in figure.levels:
        drawn.add_hline(y=value, line={"color": "#555", "width": 1, "dash": "dot"}, annotation_text=_escaped(text))
    for value, text in figure.marks:
        drawn.add_vline(x=value, line={"color": "#555", "width": 1, "dash": "dot"})
        place = math.log10(value) if figure.log_x else value  # plotly wants it so for annotations, but not for lines
        annotation = {"yref": "paper", "y": 1.0, "yanchor": "top", "xanchor": "right", "showarrow": False, "textangle": -90}
        drawn.add_annotation(x=place, text=_escaped(text), **annotation)
    if figure.right_label:
        right = {"overlaying": "y", "side": "right", "showgrid": False, "tickmode": "auto"}  # round numbers of its own
        drawn.update_layout(yaxis2={"title": _escaped(figure.right_label), **right})
    drawn.update_layout(
        xaxis={"title": _escaped(figure.x_label), "type": "log" if figure.log_x else "linear"},
        yaxis={"title": _escaped(figure.y_label), "rangemode": "tozero"},
        template="plotly_white",
        height=440,
        showlegend=True,
        legend=_BELOW,
        margin={"l": 60, "r": 60 if figure.right_label else 10, "t": 36, "b": 60},
        hovermode="x unified" if all(line.joined for line in figure.lines) else "closest",
    )
    return _element(drawn, figure.key)


def interactive_map(map_: Map) -> str:
    """The map without its title as an HTML element, for a page that holds `plotly_script`."""
    rows, columns = map_.grid()
    titles = ["<br>".join(map(_escaped, textwrap.wrap(name, _TITLE))) for name, _ in map_.panels]
    drawn = make_subplots(
        rows, columns, shared_xaxes=True, shared_yaxes=True, subplot_titles=titles,
        horizontal_spacing=0.03, vertical_spacing=0.12 / rows,
    )  # fmt: skip
    low, high = map_.scale()
    x, y = map_.x.tolist(), map_.y.tolist()
    for i, (name, values) in enumerate(map_.panels):
        row, column = i // columns + 1, i % columns + 1
        z = [[float(f"{value:.5g}") for value in row] for row in values]  # what an eye can tell; whole numbers fill the page
        labels = (map_.x_label, map_.y_label, map_.value_label, name)
        x_label, y_label, value_label, panel = (_escaped(text).replace("%{", "% {") for text in labels)  # %{ would be a variable
        hover = f"{x_label} %{{x:.4g}}<br>{y_label} %{{y:.4g}}<br>{value_label} %{{z:.4g}}<extra>{panel}</extra>"
        drawn.add_trace(go.Heatmap(x=x, y=y, z=z, coloraxis="coloraxis", zsmooth="best", hovertemplate=hover), row=row, col=column)
        for k, (level, _) in enumerate(map_.levels):
            if np.nanmin(values) < level < np.nanmax(values):
                contours = {"start": level, "end": level, "size": 1, "coloring": "none", "showlabels": True}
                contours["labelfont"] = {"color": "white", "size": 12}
                line = {"color": "white", "width": 1 if k else 3}
                trace = go.Contour(x=x, y=y, z=z, contours=contours, line=line, showscale=False, hoverinfo="skip")
                drawn.add_trace(trace, row=row, col=column)
        marks = {"color": "white", "symbol": "cross-thin", "size": 10, "line": {"color": "white", "width": 2}}
        px, py = [point[0] for point in map_.points], [point[1] for point in map_.points]
        drawn.add_trace(
            go.Scatter(x=px, y=py, mode="markers", cliponaxis=False, marker=marks, showlegend=False, hoverinfo="skip"),
            row=row,
            col=column,
        )
    for column in range(1, columns + 1) if columns < 3 else (2,):  # three side by side would touch each other
        drawn.update_xaxes(title=_escaped(map_.x_label), row=rows, col=column)
    drawn.update_xaxes(range=[x[0], x[-1]])
    drawn.update_yaxes(range=[y[0], y[-1]])
    for row in range(rows):
        drawn.update_yaxes(title=_escaped(map_.y_label), row=row + 1, col=1)
    drawn.update_layout(
        coloraxis={
            "colorscale": "Cividis",
            "cmin": low,
            "cmax": high,
            "colorbar": {"title": {"text": _escaped(map_.value_label), "side": "right"}},
        },
        template="plotly_white",
        height=130 + 280 * rows,
        showlegend=False,
        margin={"l": 60, "r": 10, "t": 60, "b": 60},
    )
    return _element(drawn, map_.key)


def _escaped(text: str) -> str:
    """Text that plotly shows unchanged: otherwise it takes some tags for formatting, and $ for the start of a formula."""
    return html.escape(text, quote=False).replace("$", "&#36;")


def _element(drawn: go.Figure, key: str) -> str:
    return drawn.to_html(full_html=False, include_plotlyjs=False, div_id=key, config={"displaylogo": False, "responsive": True})

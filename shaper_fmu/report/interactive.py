"""Figures for the page: plotly."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from shaper_fmu.report.figures import Figure


def plotly_script() -> str:
    """plotly's JavaScript, to be put into the page once."""
    return get_plotlyjs()


def interactive(figure: Figure) -> str:
    """The figure as an HTML element, for a page that holds `plotly_script`."""
    drawn = go.Figure()
    for line, (colour, dash) in zip(figure.lines, figure.styles(), strict=True):
        style = {"color": colour, "dash": dash, "width": 2}
        mode = "lines+markers" if line.markers else "lines"
        drawn.add_trace(go.Scatter(x=line.x.tolist(), y=line.y.tolist(), name=line.name, mode=mode, line=style))
    for value, text in figure.levels:
        drawn.add_hline(y=value, line={"color": "#555", "width": 1, "dash": "dot"}, annotation_text=text)
    for value, text in figure.marks:
        drawn.add_vline(x=value, line={"color": "#555", "width": 1, "dash": "dot"}, annotation_text=text)
    drawn.update_layout(
        title={"text": figure.title, "x": 0.01, "xanchor": "left"},
        xaxis={"title": figure.x_label},
        yaxis={"title": figure.y_label, "rangemode": "tozero"},
        template="plotly_white",
        height=440,
        showlegend=True,
        margin={"l": 70, "r": 30, "t": 60, "b": 60},
        hovermode="x unified",
    )
    return drawn.to_html(
        full_html=False, include_plotlyjs=False, div_id=figure.key, config={"displaylogo": False, "responsive": True}
    )

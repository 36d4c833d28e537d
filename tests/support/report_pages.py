"""What is in a report's page: its figures' data, in their order."""

from __future__ import annotations

import json
import re
from typing import Any

from browser import Browser

_FIGURE = re.compile(r'<div id="([^"]+)"></div><script class="chart-data" type="application/json">(.*?)</script>', re.DOTALL)


def figures_of(page: str) -> dict[str, dict[str, Any]]:
    """The data that each figure is drawn from, by its key."""
    return {key: json.loads(text) for key, text in _FIGURE.findall(page)}


def undrawn(chromium: Browser) -> list[str]:
    """Figures without a picture of their own: more than an empty canvas has colours."""
    drawn = "(c) => new Set(new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size > 8"
    figures = "[...document.querySelectorAll('script.chart-data')].map((s) => s.previousElementSibling)"
    return chromium.run(f"{figures}.filter((e) => !e.chart || ![...e.querySelectorAll('canvas')].every({drawn})).map((e) => e.id)")

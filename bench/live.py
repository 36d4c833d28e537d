"""The live page in headless chromium: from a slider's event to the picture, a design for two modes and 2,000 steps of a mass."""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import median
from tempfile import mkdtemp

from harness import Row

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from browser import CHROMIUM, browser

from shaper_fmu.live.page import write_live_page

ALLOWED = 16.0
"""Milliseconds."""
_EVENTS = 101
_FRAMES = """
globalThis.frames = [];
document.addEventListener("input", (event) => requestAnimationFrame(() => {
  const channel = new MessageChannel();
  channel.port1.onmessage = () => frames.push(performance.now() - event.timeStamp);
  channel.port2.postMessage(0);
}));
"""


def live_input_to_picture(folder: Path) -> Row:
    """Both modes' sliders are moved by keys; every chart and number is drawn anew."""
    name = "live_input_to_picture"
    page = write_live_page(folder / "live.html")
    with browser(Path(mkdtemp(dir=folder))) as chromium:
        chromium.open(f"{page.as_uri()}#shaper=zvd&modes=10,0.05;27,0.02&plant=MassSpringDamper")
        chromium.until("globalThis.live !== undefined && live.result !== undefined")
        chromium.run(_FRAMES)
        for i in range(_EVENTS):
            chromium.run(f"document.getElementById('slider-frequency-{1 + i % 2}').focus()")
            chromium.key("ArrowRight" if i % 4 < 2 else "ArrowLeft")
        chromium.until(f"frames.length >= {_EVENTS}")
        drawn, shown = chromium.run("live.took"), chromium.run("frames")
    if len(drawn) < _EVENTS:
        raise SystemExit(f"{name}: {len(drawn)} of {_EVENTS} events were drawn")
    note = (
        f"until all is drawn, median of {_EVENTS}; until the frame that shows it {median(shown):.3g} ms; {ALLOWED:g} ms are allowed"
    )
    return Row(name, median(drawn) * 1e3, note=note)


LIVE = (live_input_to_picture,) if CHROMIUM else ()
"""The row, where there is a browser."""

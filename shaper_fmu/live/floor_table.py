"""The floor of positive shapers as a table, from which the page interpolates.

`python -m shaper_fmu.live.floor_table` computes it anew, in ten minutes.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from shaper_fmu.design.floor import shortest_duration

TABLE = Path(__file__).parent / "static" / "floor.json"
TOLERANCES = (0.005, 0.0075, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.125, 0.15, 0.2, 0.25, 0.3)
INSENSITIVITIES = tuple(round(0.01 * i, 2) for i in range(20)) + tuple(round(0.02 * i, 2) for i in range(10, 76))
"""Dense where the floor is steep."""


def floor_table() -> dict[str, Any]:
    """Shortest durations in undamped periods by tolerance (rows) and insensitivity (columns)."""
    rows = [[round(shortest_duration(i, v), 6) for i in INSENSITIVITIES] for v in TOLERANCES]
    return {"tolerances": TOLERANCES, "insensitivities": INSENSITIVITIES, "durations": rows}


if __name__ == "__main__":
    TABLE.write_text(json.dumps(floor_table(), separators=(",", ":")) + "\n")

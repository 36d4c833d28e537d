"""FMUs of a tool whose event mode is known to be wrong are kept out of it, with a word. Expected values: the formula of the lag."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from reading_fmus import lag_fmu, lagged

from shaper_fmu import System

STEP = 0.125
JUMPS = np.array([[0.0, 1.0], [0.25, 5.0], [0.5, -1.0]])
INPUTS = np.array([1.0, 1.0, 5.0, 5.0, -1.0, -1.0, -1.0, -1.0])
"""Of each step of 1 s."""


def made_by(tool: str, folder: Path) -> Path:
    """The lag with event mode, as if this tool had made it."""
    path = folder / "lag.fmu"
    with zipfile.ZipFile(lag_fmu(3, event_mode=True)) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(b' modelName="lag"', f' modelName="lag" generationTool="{tool}"'.encode())
            target.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("tool", "by_user", "used"),
    [
        ("Dymola Version 2023x Refresh 1, 2023-04-12", None, False),
        ("Dymola Version 2023x Refresh 1, 2023-04-12", True, True),
        ("Dymola Version 2024x, 2023-10-06", None, True),
        ("Dymola Version 2024x, 2023-10-06", False, False),
        ("Another", None, True),
    ],
)
def test_event_mode_that_is_known_to_be_wrong_is_not_used(tool, by_user, used, tmp_path):
    system = System()
    system.add("lag", made_by(tool, tmp_path), count_in=3, strict=1)
    system.drive("lag.u", JUMPS)
    if by_user is not None:
        system.use_event_mode("lag", by_user)
    results = system.simulate(1.0, STEP, record=["lag.x", "lag.through"])
    x = lagged(INPUTS, STEP)
    assert results["lag.x"] == pytest.approx(x, rel=1e-14)
    held = np.concatenate([INPUTS[:1], INPUTS])  # what the last step had; an event reads anew at the jumps
    if used:
        held[[2, 4]] = INPUTS[[2, 4]]
    assert results["lag.through"] == pytest.approx(x + held, rel=1e-14)
    told = [note for note in results.notes if "event mode" in note]
    assert bool(told) == ("2023x" in tool)
    if told:
        assert told[0].endswith("it is used all the same" if used else "it is not used, so that its own events end no step")

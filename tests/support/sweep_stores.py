"""Sweeps of the crane for the tests of the report: studies, their stores, and SQL to read them."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np

from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.study import read_study

SYSTEMS = Path(__file__).parents[2] / "ssp"
LENGTH, DAMPING = "crane.initial_rope_length", "crane.damping_ratio"

HEAD = """
name = "Crane <b>& rope</b>"
system = "crane.ssp"
stop_time = 24.0
step = 0.02
reference = "unshaped"

[metrics.residual_swing]
kind = "residual"
output = "crane.swing_angle"
command = "shaper.shaped_mean"
"""
SMALL = """
[compare]
unshaped = { "shaper.shaper" = "none", "profile.distance" = 0.01 }
ZV = { "shaper.shaper" = "zv", "profile.distance" = 0.01 }
ZVD = { "shaper.shaper" = "zvd", "profile.distance" = 0.01 }
EI = { "shaper.shaper" = "ei", "profile.distance" = 0.01 }
"""
ROPE = f"""
[vary."{LENGTH}"]
nominal = 8.0
low = 6.0
high = 10.0
points = 9
"""
DAMPED = f"""
[vary."{DAMPING}"]
low = 0.0
high = 0.08
points = 5
"""
REFINED = """
[refine]
metric = "residual_swing"
level = 0.05
width = 0.01
"""
RANDOM = f"""
[plan]
kind = "random"
samples = 150
seed = 3

[vary."{LENGTH}"]
nominal = 8.0
distribution = "normal"
deviation = 0.4

[vary."{DAMPING}"]
low = 0.0
high = 0.05
"""
HOSTILE = f"""
[compare]
unshaped = {{ "shaper.shaper" = "none" }}
'<img src="x" onerror="console.error(1)"></script> $x_1$ %{{y}}' = {{ "crane.hoist_speed" = 0.35 }}
"_ZVD & more" = {{ "shaper.shaper" = "zvd" }}

[vary."{LENGTH}"]
nominal = 9.0
low = 6.0
high = 11.0
points = 41

[vary."{DAMPING}"]
low = 0.0
high = 0.05
points = 3
"""


def packed_crane(folder: Path, fmus: Path) -> Path:
    """The folder, with the crane's system in it."""
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    return folder


def swept(folder: Path, name: str, text: str) -> Path:
    """The store of a study, swept in this process."""
    (folder / f"{name}.toml").write_text(text)
    run_study(read_study(folder / f"{name}.toml"), folder / f"{name}.sqlite")
    return folder / f"{name}.sqlite"


def query(store: Path, text: str, *values: object) -> list[tuple]:
    database = sqlite3.connect(store)
    try:
        return database.execute(text, values).fetchall()
    finally:
        database.close()


def shares(store: Path, case: str) -> np.ndarray:
    """Each point of a case, and its residual as a share of the unshaped one, by SQL; shape (n, 3)."""
    return np.array(
        query(
            store,
            f'SELECT c."{LENGTH}", c.residual_swing / u.residual_swing, c.residual_swing FROM run c JOIN run u '
            f'ON c."{LENGTH}" = u."{LENGTH}" WHERE c.compared = ? AND u.compared = "unshaped" AND c.status = "done"',
            case,
        )
    )

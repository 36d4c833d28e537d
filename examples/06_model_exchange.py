"""Two masses that act on each other, as FMUs of model exchange: solved as one system of equations, and coupled at steps.

Solved as one there is no coupling error, whatever the communication step; at steps it falls with the step.
Leaves results/06_model_exchange.png.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from shaper_fmu import System, build_fmu, find_component
from shaper_fmu.page import Figure, Line, write_picture

GAIN, STIFFNESS, DAMPING = 40.0, (100.0, 150.0), 0.3  # N/m, N/m, N.s/m; masses of 1 kg
STOP = 2.0

build_fmu(find_component("MassSpringDamper"), "fmus", platforms=["this"])

system = System("two_masses")
for name, stiffness in zip("ab", STIFFNESS, strict=True):
    values = {"stiffness": stiffness, "damping": DAMPING}
    system.add(name, "fmus/MassSpringDamper.fmu", values, interface="model_exchange")
system.connect_raw("a.position", "b.force", gain=GAIN)
system.connect_raw("b.position", "a.force", gain=GAIN, offset=1.0)  # a force of 1 N on the first one besides

matrix = np.zeros((5, 5))  # x1, x2, v1, v2, 1
matrix[:2, 2:4] = np.eye(2)
matrix[2:4, :2] = [[-STIFFNESS[0], GAIN], [GAIN, -STIFFNESS[1]]]
matrix[2:4, 2:4] = -DAMPING * np.eye(2)
matrix[2, 4] = 1.0


def exact(time: np.ndarray) -> np.ndarray:
    """The first mass's position, by the matrix exponential of the whole."""
    return np.array([(expm(matrix * t) @ [0.0, 0.0, 0.0, 0.0, 1.0])[0] for t in time])


steps = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1]
errors = {}
for coupling in ("steps", "monolithic"):
    runs = [system.simulate(STOP, step, coupling=coupling, solver_tolerance=1e-10) for step in steps]
    errors[coupling] = [float(np.abs(results["a.position"] - exact(results.time)).max()) for results in runs]
    print(f"{coupling:10}  largest error {max(errors[coupling]):.1e} m, smallest {min(errors[coupling]):.1e} m")
orders = [np.log(b / a) / np.log(d / c) for (a, b), (c, d) in zip(pairwise(errors["steps"][:3]), pairwise(steps[:3]), strict=True)]
print(f"coupled at steps, observed orders {', '.join(f'{order:.2f}' for order in orders)}")

labels = {"steps": "coupled at steps", "monolithic": "solved as one"}
lines = [Line(labels[name], np.log10(steps), np.log10(found), markers=True) for name, found in errors.items()]
figure = Figure(
    "error",
    "Two masses that act on each other: largest error within 2 s",
    "log10 of the communication step [s]",
    "log10 error [m]",
    lines,
)
print(write_picture(figure, Path("results/06_model_exchange.png")))

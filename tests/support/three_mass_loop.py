"""The example of Jung 2011 as matrices: the chain of three masses under F = 300 (r - x1) - 50 v1, and its step response."""

from __future__ import annotations

import numpy as np

from shaper_fmu.design.modal_responses import ModalResponse, step_response

MASS, STIFFNESS, DAMPING = (15.0, 8.0, 10.0), (400.0, 120.0), (20.0, 6.0)
KP, KD = 300.0, 50.0
_SPRINGS = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])


def open_loop() -> tuple[np.ndarray, np.ndarray]:
    """A (6 by 6) and b (6,) of x' = A x + b F, x = [positions, velocities]."""
    inverse = np.diag(1.0 / np.array(MASS))
    k, c = (_SPRINGS.T @ np.diag(values) @ _SPRINGS for values in (STIFFNESS, DAMPING))
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ k, -inverse @ c]])
    return a, np.array([0.0, 0.0, 0.0, 1.0 / MASS[0], 0.0, 0.0])


def closed_loop() -> tuple[np.ndarray, np.ndarray]:
    """A and b of x' = A x + b r with the controller."""
    a, b = open_loop()
    return a - np.outer(b, [KP, 0.0, 0.0, KD, 0.0, 0.0]), KP * b


def response() -> ModalResponse:
    a, b = closed_loop()
    return step_response(a, b, np.eye(6)[:3])

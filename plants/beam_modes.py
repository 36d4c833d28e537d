"""Modes of a beam that is clamped at one end and has a point mass at the other: frequencies, participation, propagation.

Euler-Bernoulli; Rao, Mechanical Vibrations, chapter 8. `FlexibleBeam` moves the clamped end along a line, `RotatingBeam` turns it.
"""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Component, Local, Parameter, State, Variable
from shaper_fmu.propagation import oscillator_forcing, oscillator_transition

MODES = 5
TIP_TOO_HEAVY = 1
SLOWEST = 1e-9
"""Frequencies below this [rad/s] count as this for what is told to solvers."""


class ModalBeam(Component):
    """A beam in up to five modes, and what propagates them exactly over a step."""

    messages: ClassVar[dict[int, str]] = {
        TIP_TOO_HEAVY: "tip_mass = {tip_mass} kg is more than 1e12 times beam_mass = {beam_mass} kg, so that the beam's own modes "
        "cannot be told; make beam_mass larger"
    }
    default_step_size: ClassVar[float] = 0.001

    length: Variable[float] = Parameter(0.25, "m", "length of the beam", min=0.0, exclusive=True, published=(1e-9, None))
    thickness: Variable[float] = Parameter(
        0.002, "m", "thickness of the beam in the direction in which it bends", min=0.0, exclusive=True, published=(1e-9, None)
    )
    width: Variable[float] = Parameter(0.025, "m", "width of the beam", min=0.0, exclusive=True, published=(1e-9, None))
    youngs_modulus: Variable[float] = Parameter(3e9, "Pa", "Young's modulus", min=0.0, exclusive=True, published=(1e-9, None))
    beam_mass: Variable[float] = Parameter(
        0.02, "kg", "mass of the beam, without the tip mass", min=0.0, exclusive=True, published=(1e-12, None)
    )
    tip_mass: Variable[float] = Parameter(0.015, "kg", "point mass at the tip", min=0.0)
    modes: Variable[int] = Parameter(1, "", "number of modes that move", min=1, max=MODES)
    modal_damping: Variable[list[float]] = Parameter(
        0.0, "", "damping ratio of each mode", size=MODES, min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
    )
    natural_frequency: Variable[list[float]] = Calculated(
        "rad/s", "undamped natural frequency of each mode, moving or not", size=MODES
    )
    modal_deflection: Variable[list[float]] = Local(
        "m", "deflection of the tip in each mode", size=MODES, derivative="modal_velocity", nominal="usual_deflection"
    )
    modal_velocity: Variable[list[float]] = Local(
        "m/s",
        "speed of the tip against the clamped end in each mode",
        size=MODES,
        derivative="modal_acceleration",
        nominal="usual_deflection_rate",
    )
    modal_acceleration: Variable[list[float]] = Local(
        "m/s2", "acceleration of the tip against the clamped end in each mode", size=MODES
    )

    usual_deflection: Variable[list[float]] = State(1.0, size=MODES)  # under 0.1 m/s2
    usual_deflection_rate: Variable[list[float]] = State(1.0, size=MODES)
    root: Variable[list[float]] = State(size=MODES)  # frequency parameter beta of each mode
    known_step: Variable[float] = State(-1.0)  # the step that the responses belong to
    transition: Variable[list[float]] = State(size=4)
    impulse_response: Variable[list[float]] = State(size=MODES)  # of each mode over the step; see shaper_fmu/propagation.py
    velocity_kept: Variable[list[float]] = State(size=MODES)
    held_response: Variable[list[float]] = State(size=MODES)
    ramp_response: Variable[list[float]] = State(size=MODES)


def start_modes(m: ModalBeam) -> int:
    """Frequency of each mode; returns 0 or a status."""
    ratio = m.tip_mass / m.beam_mass
    if not ratio <= 1e12:
        return TIP_TOO_HEAVY
    rigidity = m.youngs_modulus * m.width * m.thickness * m.thickness * m.thickness / 12.0
    scale = math.sqrt(rigidity / (m.beam_mass * m.length * m.length * m.length))
    for j in range(MODES):
        beta = frequency_parameter(j, ratio)
        m.root[j] = beta
        m.natural_frequency[j] = beta * beta * scale
    return 0


def note_usual_sizes(m: ModalBeam, j: int, push: float) -> None:
    """What is usual in a mode that is pushed with the acceleration `push` [m/s2], for solvers."""
    m.usual_deflection_rate[j] = push / max(m.natural_frequency[j], SLOWEST)
    m.usual_deflection[j] = m.usual_deflection_rate[j] / max(m.natural_frequency[j], SLOWEST)


def frequency_parameter(j: int, ratio: float) -> float:
    """beta of mode j, counted from 0: w = beta^2 sqrt(EI / (m L^3)) with the beam's mass m; ratio is tip mass / m.

    It solves 1 + cos beta cosh beta - ratio beta (sin beta cosh beta - cos beta sinh beta) = 0, divided by cosh beta so that it
    cannot overflow. The root falls from that of the free to that of the pinned end as the ratio rises from 0 to infinity, so
    [j pi, (j + 1) pi] holds this one alone: Newton's method, with bisection where it would leave the bracket.
    """
    low = j * math.pi
    high = low + math.pi
    falling = j % 2 == 0  # the left side is 2 at beta = 0, and changes sign at each root
    beta = low + 0.5 * math.pi
    if j == 0:  # Rayleigh's estimate: 33/140 of the beam's mass moves with the tip
        beta = math.sqrt(math.sqrt(3.0 / (ratio + 33.0 / 140.0)))
    for _ in range(100):
        sech, tanh = hyperbolic(beta)
        difference = sine_difference(beta, sech, tanh)
        value = sech + math.cos(beta) - ratio * beta * difference
        if (value > 0.0) == falling:
            low = beta
        else:
            high = beta
        slope = -(1.0 + ratio) * difference - 2.0 * ratio * beta * math.sin(beta) * tanh
        found = beta - value / slope if slope != 0.0 else low
        if not low < found < high:
            found = 0.5 * (low + high)
        if abs(found - beta) <= 2e-16 * beta:
            return found
        beta = found
    return beta


def participation_factor(beta: float, ratio: float) -> float:
    """Gamma = phi(L) (integral of phi dm + tip mass phi(L)) / (integral of phi^2 dm + tip mass phi(L)^2) of a mode shape phi.

    phi(x) = cosh k x - cos k x - gamma (sinh k x - sin k x), k = beta/L. The integral of phi, taken by the equation of the mode
    itself, is 2 gamma m / beta with the tip mass; that of phi^2 is `modal_share`'s.
    """
    sech, tanh = hyperbolic(beta)
    tip = 2.0 * tip_difference(beta, ratio) / (tanh + math.sin(beta) * sech)
    return 8.0 * shape_constant(beta) / (beta * tip * modal_share(beta, ratio))


def modal_share(beta: float, ratio: float) -> float:
    """Four times the modal mass at the tip, as a share of the beam's mass: 1 + ratio + 2 ratio beta s, s = phi'(L) / (k phi(L)).

    The integral of phi^2 dm with the tip mass, taken by the equation of the mode itself, is m phi(L)^2 times a quarter of this.
    """
    _, tanh = hyperbolic(beta)
    tip_slope = math.sin(beta) * tanh / tip_difference(beta, ratio)
    return 1.0 + ratio + 2.0 * ratio * beta * tip_slope


def shape_constant(beta: float) -> float:
    """gamma = (cosh beta + cos beta) / (sinh beta + sin beta) of a mode shape."""
    sech, tanh = hyperbolic(beta)
    return (1.0 + math.cos(beta) * sech) / (tanh + math.sin(beta) * sech)


def tip_difference(beta: float, ratio: float) -> float:
    """sin beta - cos beta tanh beta of a root; for a heavy tip the frequency equation tells this small difference better."""
    sech, tanh = hyperbolic(beta)
    if ratio > 1.0:
        return (sech + math.cos(beta)) / (ratio * beta)
    return sine_difference(beta, sech, tanh)


def hyperbolic(beta: float) -> tuple[float, float]:
    """1 / cosh beta and tanh beta, for beta > 0, without overflow."""
    e = math.exp(-beta)
    return 2.0 * e / (1.0 + e * e), (1.0 - e * e) / (1.0 + e * e)


def sine_difference(beta: float, sech: float, tanh: float) -> float:
    """sin beta - cos beta tanh beta; for small beta, where that cancels, by the series of sin cosh - cos sinh."""
    if beta > 0.5:
        return math.sin(beta) - math.cos(beta) * tanh
    fourth = beta * beta * beta * beta
    series = 2.0 / 3.0 - fourth * (1.0 / 315.0 - fourth * (2.0 / 1247400.0 - fourth / 5108103000.0))
    return sech * beta * beta * beta * series


def find_responses(m: ModalBeam, h: float) -> None:
    """The moving modes' responses over a step h > 0, kept while the step stays."""
    if h == m.known_step:
        return
    m.known_step = h
    for j in range(m.modes):
        oscillator_transition(m.transition, m.natural_frequency[j], m.modal_damping[j], h)
        held, ramp = oscillator_forcing(m.transition, m.natural_frequency[j], m.modal_damping[j], h)
        m.impulse_response[j] = m.transition[1]
        m.velocity_kept[j] = m.transition[3]
        m.held_response[j] = held
        m.ramp_response[j] = ramp


def advance_mode(m: ModalBeam, j: int, push: float, growing: float) -> None:
    """Advance a mode by the known step, for the modal acceleration push + growing s [m/s2]."""
    w = m.natural_frequency[j]
    unbalanced = push - w * w * m.modal_deflection[j]
    speed = m.modal_velocity[j]
    m.modal_deflection[j] += m.impulse_response[j] * speed + m.held_response[j] * unbalanced + m.ramp_response[j] * growing
    m.modal_velocity[j] = m.velocity_kept[j] * speed + m.impulse_response[j] * unbalanced + m.held_response[j] * growing


def modal_acceleration(m: ModalBeam, j: int, push: float) -> float:
    """Acceleration of the tip against the clamped end's frame in a mode, which is pushed with the acceleration `push` [m/s2]."""
    w = m.natural_frequency[j]
    restored = 2.0 * m.modal_damping[j] * w * m.modal_velocity[j] + w * w * m.modal_deflection[j]
    return push - restored

"""Flexible beam: a cantilever with a tip mass on a base that is moved across it."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Component, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.propagation import oscillator_forcing, oscillator_transition

MODES = 5
TIP_TOO_HEAVY = 1
SLOWEST = 1e-9
"""Frequencies below this [rad/s] count as this for what is told to solvers."""


class FlexibleBeam(Component):
    """Euler-Bernoulli cantilever with a tip mass on a moving base, in up to five modes, from rest.

    The base moves across the beam with the input acceleration a. Mode j adds q_j to the tip's deflection,

    q_j'' + 2 zeta_j w_j q_j' + w_j^2 q_j = -Gamma_j a,

    and w_j solves the frequency equation of a beam with a point mass at its end. All five frequencies and participation
    factors Gamma_j are computed; the first `modes` modes move. Modes and base are propagated exactly for inputs that are held
    or linear over a step. The defaults are the PMMA beam of Ozokutan, Karadag, Kapucu and Kutuk (2025), with its first mode.
    """

    messages: ClassVar[dict[int, str]] = {
        TIP_TOO_HEAVY: "tip_mass = {tip_mass} kg is more than 1e12 times beam_mass = {beam_mass} kg, so that the beam's own modes "
        "cannot be told; make beam_mass larger"
    }
    default_step_size: ClassVar[float] = 0.001
    continuous_states: ClassVar[tuple[str, ...] | None] = ("base_position", "base_velocity", "modal_deflection", "modal_velocity")
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"acceleration": "base_acceleration"},
        "plant": {
            "base_position": "base_position",
            "tip_deflection": "tip_deflection",
            "tip_position": "tip_position",
            "tip_acceleration": "tip_acceleration",
        },
    }

    base_acceleration: Variable[float] = Input("m/s2", "acceleration of the base, across the beam", slope="base_acceleration_slope")
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
    participation: Variable[list[float]] = Calculated(
        "", "participation factor of each mode at the tip; all modes together: 1", size=MODES
    )
    base_position: Variable[float] = Output(
        "m", "position of the base", depends=(), derivative="base_velocity", nominal="usual_base_position"
    )
    tip_deflection: Variable[float] = Output(
        "m", "deflection of the tip against the base", depends=(), derivative="tip_deflection_rate"
    )
    tip_position: Variable[float] = Output("m", "position of the tip", depends=(), derivative="tip_velocity")
    tip_acceleration: Variable[float] = Output(
        "m/s2", "acceleration of the tip, that of the base included", depends=("base_acceleration",)
    )
    base_velocity: Variable[float] = Local(
        "m/s", "speed of the base", derivative="base_velocity_rate", nominal="usual_base_velocity"
    )
    base_velocity_rate: Variable[float] = Local("m/s2", "acceleration of the base")
    tip_velocity: Variable[float] = Local("m/s", "speed of the tip, that of the base included", derivative="tip_acceleration")
    tip_deflection_rate: Variable[float] = Local("m/s", "speed of the tip against the base")
    modal_deflection: Variable[list[float]] = Local(
        "m", "deflection of the tip in each mode", size=MODES, derivative="modal_velocity", nominal="usual_deflection"
    )
    modal_velocity: Variable[list[float]] = Local(
        "m/s",
        "speed of the tip against the base in each mode",
        size=MODES,
        derivative="modal_acceleration",
        nominal="usual_deflection_rate",
    )
    modal_acceleration: Variable[list[float]] = Local("m/s2", "acceleration of the tip against the base in each mode", size=MODES)

    usual_base_position: Variable[float] = State(1.0)  # under 0.1 m/s2
    usual_base_velocity: Variable[float] = State(1.0)
    usual_deflection: Variable[list[float]] = State(1.0, size=MODES)
    usual_deflection_rate: Variable[list[float]] = State(1.0, size=MODES)
    base_acceleration_slope: Variable[float] = State(0.0)
    known_step: Variable[float] = State(-1.0)  # the step that the responses belong to
    transition: Variable[list[float]] = State(size=4)
    impulse_response: Variable[list[float]] = State(size=MODES)  # of each mode over the step; see shaper_fmu/propagation.py
    velocity_kept: Variable[list[float]] = State(size=MODES)
    held_response: Variable[list[float]] = State(size=MODES)
    ramp_response: Variable[list[float]] = State(size=MODES)

    def start(self) -> int:
        ratio = self.tip_mass / self.beam_mass
        if not ratio <= 1e12:
            return TIP_TOO_HEAVY
        rigidity = self.youngs_modulus * self.width * self.thickness * self.thickness * self.thickness / 12.0
        scale = math.sqrt(rigidity / (self.beam_mass * self.length * self.length * self.length))
        for j in range(MODES):
            beta = frequency_parameter(j, ratio)
            self.natural_frequency[j] = beta * beta * scale
            self.participation[j] = participation_factor(beta, ratio)
            share = 0.1 * abs(self.participation[j])
            self.usual_deflection_rate[j] = share / max(self.natural_frequency[j], SLOWEST)
            self.usual_deflection[j] = self.usual_deflection_rate[j] / max(self.natural_frequency[j], SLOWEST)
        self.usual_base_velocity = 0.1 / max(self.natural_frequency[0], SLOWEST)
        self.usual_base_position = self.usual_base_velocity / max(self.natural_frequency[0], SLOWEST)
        return 0

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            if h != self.known_step:
                self.known_step = h
                find_responses(self, h)
            push = self.base_acceleration
            rise = self.base_acceleration_slope
            for j in range(self.modes):
                advance_mode(self, j, push, rise)
            self.base_position += (self.base_velocity + (0.5 * push + rise * h / 6.0) * h) * h
            self.base_velocity += (push + 0.5 * rise * h) * h
            self.base_acceleration += rise * h
        self.base_velocity_rate = self.base_acceleration
        self.tip_deflection = 0.0
        self.tip_deflection_rate = 0.0
        self.tip_acceleration = self.base_acceleration
        for j in range(self.modes):
            self.modal_acceleration[j] = modal_acceleration(self, j)
            self.tip_deflection += self.modal_deflection[j]
            self.tip_deflection_rate += self.modal_velocity[j]
            self.tip_acceleration += self.modal_acceleration[j]
        self.tip_position = self.base_position + self.tip_deflection
        self.tip_velocity = self.base_velocity + self.tip_deflection_rate
        return 0


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

    phi(x) = cosh k x - cos k x - gamma (sinh k x - sin k x), k = beta/L. The integrals are taken by the equation of the mode
    itself: that of phi is 2 gamma m / beta with the tip mass, that of phi^2 is m phi(L)^2 (1 + ratio + 2 ratio beta s) / 4 with
    s = phi'(L) / (k phi(L)).
    """
    sech, tanh = hyperbolic(beta)
    sine = math.sin(beta)
    difference = sine_difference(beta, sech, tanh)
    if ratio > 1.0:  # for a heavy tip that is a small difference of large numbers; the frequency equation tells it better
        difference = (sech + math.cos(beta)) / (ratio * beta)
    gamma = (1.0 + math.cos(beta) * sech) / (tanh + sine * sech)
    tip = 2.0 * difference / (tanh + sine * sech)
    tip_slope = sine * tanh / difference
    return 8.0 * gamma / (beta * tip * (1.0 + ratio + 2.0 * ratio * beta * tip_slope))


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


def find_responses(m: FlexibleBeam, h: float) -> None:
    """The moving modes' responses over a step h > 0."""
    for j in range(m.modes):
        oscillator_transition(m.transition, m.natural_frequency[j], m.modal_damping[j], h)
        held, ramp = oscillator_forcing(m.transition, m.natural_frequency[j], m.modal_damping[j], h)
        m.impulse_response[j] = m.transition[1]
        m.velocity_kept[j] = m.transition[3]
        m.held_response[j] = held
        m.ramp_response[j] = ramp


def advance_mode(m: FlexibleBeam, j: int, push: float, rise: float) -> None:
    """Advance a mode by the known step, for a base acceleration push + rise s."""
    w = m.natural_frequency[j]
    unbalanced = -m.participation[j] * push - w * w * m.modal_deflection[j]
    growing = -m.participation[j] * rise
    speed = m.modal_velocity[j]
    m.modal_deflection[j] += m.impulse_response[j] * speed + m.held_response[j] * unbalanced + m.ramp_response[j] * growing
    m.modal_velocity[j] = m.velocity_kept[j] * speed + m.impulse_response[j] * unbalanced + m.held_response[j] * growing


def modal_acceleration(m: FlexibleBeam, j: int) -> float:
    """Acceleration of the tip against the base in a mode [m/s2]."""
    w = m.natural_frequency[j]
    restored = 2.0 * m.modal_damping[j] * w * m.modal_velocity[j] + w * w * m.modal_deflection[j]
    return -m.participation[j] * m.base_acceleration - restored

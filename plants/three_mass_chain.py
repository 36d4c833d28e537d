"""Three masses in a row, tied by springs and dampers: a flexible machine with two modes, propagated without error."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Component, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.matrix_exponential import phi_functions, power_of_two
from shaper_fmu.quartic import quadratic_factors

TOO_FAST = 1
MASSES = 3
SPRINGS = 2
STATES = 4  # of the relative motion
SQUARE = STATES * STATES


class ThreeMassChain(Component):
    """Three masses, free to move along a line and tied to their neighbours by springs and dampers (Jung 2011, Fig. 3).

    m1 x1'' = F + d1 + k1 (x2 - x1) + c1 (x2' - x1'); m2 x2'' = d2 - k1 (x2 - x1) - c1 (x2' - x1') + k2 (x3 - x2) + c2 (x3' - x2');
    m3 x3'' = d3 - k2 (x3 - x2) - c2 (x3' - x2'). From rest at 0.

    The centre of mass follows its polynomial, and the springs' elongations the matrix exponential of the step, kept while
    the step stays the same: exact for held inputs, and for a force that is linear over the step; nothing drifts. Any damping
    is allowed, proportional or not.

    natural_frequency and damping_ratio are those of the free-free chain's two flexible modes: |s| and -Re(s) / |s| of a
    complex pair of poles. An overdamped pair r1, r2 has the frequency sqrt(r1 r2) and the damping ratio (r1 + r2) / 2 over
    it; of four real poles the outer two and the inner two are a pair.
    """

    messages: ClassVar[dict[int, str]] = {
        TOO_FAST: "the step is more than 1e11 times as long as the chain's fastest time constant; use shorter steps, a softer "
        "or a heavier chain"
    }
    continuous_states: ClassVar[tuple[str, ...] | None] = ("position", "velocity")
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "plant": {"force": "force", "positions": "position", "velocities": "velocity"},
    }

    force: Variable[float] = Input("N", "force on mass 1", slope="force_slope")
    disturbance: Variable[list[float]] = Input("N", "further force on each mass", size=MASSES)
    mass: Variable[list[float]] = Parameter(
        [15.0, 8.0, 10.0], "kg", "moving masses", size=MASSES, min=0.0, exclusive=True, published=(1e-12, None)
    )
    stiffness: Variable[list[float]] = Parameter(
        [400.0, 120.0], "N/m", "stiffness of the springs 1-2 and 2-3", size=SPRINGS, min=0.0, exclusive=True, published=(1e-9, None)
    )
    damping: Variable[list[float]] = Parameter([20.0, 6.0], "N.s/m", "viscous damping beside each spring", size=SPRINGS, min=0.0)
    natural_frequency: Variable[list[float]] = Calculated(
        "rad/s", "natural frequencies of the two flexible modes, the lower one first", size=SPRINGS
    )
    damping_ratio: Variable[list[float]] = Calculated("", "damping ratios of the two flexible modes", size=SPRINGS)
    position: Variable[list[float]] = Output(
        "m", "displacement of each mass", size=MASSES, depends=(), derivative="velocity", nominal="usual_position"
    )
    velocity: Variable[list[float]] = Output(
        "m/s", "speed of each mass", size=MASSES, depends=(), derivative="acceleration", nominal="usual_velocity"
    )
    acceleration: Variable[list[float]] = Local("m/s2", "acceleration of each mass", size=MASSES, depends=("force", "disturbance"))

    usual_position: Variable[list[float]] = State(1.0, size=MASSES)  # the elongation of the stiffer spring under 1 N
    usual_velocity: Variable[list[float]] = State(1.0, size=MASSES)
    force_slope: Variable[float] = State(0.0)
    known_step: Variable[float] = State(-1.0)  # the step that the matrices belong to
    speed_scale: Variable[float] = State(1.0)  # a power of two that divides the speeds, so that the matrix has the least norm
    transition: Variable[list[float]] = State(size=SQUARE)
    held: Variable[list[float]] = State(size=SQUARE)
    ramp: Variable[list[float]] = State(size=SQUARE)
    system: Variable[list[float]] = State(size=SQUARE)
    work: Variable[list[float]] = State(size=SQUARE)
    relative: Variable[list[float]] = State(size=STATES)  # elongations, and their rates divided by speed_scale

    def start(self) -> None:
        find_modes(self)
        stiffest = max(self.stiffness[0], self.stiffness[1])
        for i in range(MASSES):
            self.usual_position[i] = 1.0 / stiffest
            self.usual_velocity[i] = self.natural_frequency[0] / stiffest

    def step(self, t: float, h: float) -> int:
        if h > 0.0:
            if h != self.known_step:
                self.known_step = -1.0
                if not prepare(self, h):
                    return TOO_FAST
                self.known_step = h
            propagate(self, h)
        accelerations(self)
        return 0


def find_modes(m: ThreeMassChain) -> None:
    """natural_frequency and damping_ratio, from the characteristic polynomial of the elongations."""
    first = 1.0 / m.mass[0] + 1.0 / m.mass[1]
    second = 1.0 / m.mass[1] + 1.0 / m.mass[2]
    both = (1.0 / m.mass[0] + 1.0 / m.mass[2]) / m.mass[1] + 1.0 / m.mass[0] / m.mass[2]
    k1, k2, c1, c2 = m.stiffness[0], m.stiffness[1], m.damping[0], m.damping[1]
    p1, q1, p2, q2 = quadratic_factors(
        first * c1 + second * c2, first * k1 + second * k2 + both * c1 * c2, both * (c1 * k2 + c2 * k1), both * k1 * k2
    )
    m.natural_frequency[0] = math.sqrt(max(0.0, q1))
    m.natural_frequency[1] = math.sqrt(max(0.0, q2))
    m.damping_ratio[0] = 0.5 * p1 / m.natural_frequency[0]
    m.damping_ratio[1] = 0.5 * p2 / m.natural_frequency[1]


def prepare(m: ThreeMassChain, h: float) -> int:
    """The matrices of the relative motion over a step of h, for [q, q' / speed_scale]; returns whether there are any."""
    first = 1.0 / m.mass[0] + 1.0 / m.mass[1]
    second = 1.0 / m.mass[1] + 1.0 / m.mass[2]
    middle = 1.0 / m.mass[1]
    m.speed_scale = power_of_two(math.sqrt(first * m.stiffness[0] + second * m.stiffness[1]))
    for i in range(SQUARE):
        m.system[i] = 0.0
    m.system[2] = m.speed_scale * h
    m.system[7] = m.speed_scale * h
    for i in range(2):
        row = STATES * (2 + i)
        near = first if i == 0 else -middle
        far = -middle if i == 0 else second
        m.system[row] = -near * m.stiffness[0] / m.speed_scale * h
        m.system[row + 1] = -far * m.stiffness[1] / m.speed_scale * h
        m.system[row + 2] = -near * m.damping[0] * h
        m.system[row + 3] = -far * m.damping[1] * h
    return phi_functions(m.system, STATES, m.transition, m.held, m.ramp, m.work) >= 0


def propagate(m: ThreeMassChain, h: float) -> None:
    """Positions, velocities and force at the end of the step of h, from those at its start."""
    m1, m2, m3 = m.mass[0], m.mass[1], m.mass[2]
    total = m1 + m2 + m3
    outer, last = (m2 + m3) / total, m3 / total  # the centre of mass is at x1 + outer q1 + last q2
    pull = (m.force + m.disturbance[0] + m.disturbance[1] + m.disturbance[2]) / total
    pull_slope = m.force_slope / total
    offset = outer * (m.position[1] - m.position[0]) + last * (m.position[2] - m.position[1])
    rate = outer * (m.velocity[1] - m.velocity[0]) + last * (m.velocity[2] - m.velocity[1])
    advance = (m.velocity[0] + rate + (0.5 * pull + pull_slope * h / 6.0) * h) * h
    gain = (pull + 0.5 * pull_slope * h) * h
    stretch(m, h)
    q1, q2 = m.relative[0], m.relative[1]
    rate1, rate2 = m.relative[2] * m.speed_scale, m.relative[3] * m.speed_scale
    m.position[0] += advance + (offset - (outer * q1 + last * q2))
    m.velocity[0] += gain + (rate - (outer * rate1 + last * rate2))
    m.position[1] = m.position[0] + q1
    m.velocity[1] = m.velocity[0] + rate1
    m.position[2] = m.position[1] + q2
    m.velocity[2] = m.velocity[1] + rate2
    m.force += m.force_slope * h


def stretch(m: ThreeMassChain, h: float) -> None:
    """Elongations and their scaled rates at the end of the step, into m.relative."""
    q1 = m.position[1] - m.position[0]
    q2 = m.position[2] - m.position[1]
    rate1 = (m.velocity[1] - m.velocity[0]) / m.speed_scale
    rate2 = (m.velocity[2] - m.velocity[1]) / m.speed_scale
    middle = m.disturbance[1] / m.mass[1]
    drive1 = (middle - (m.force + m.disturbance[0]) / m.mass[0]) / m.speed_scale * h
    drive2 = (m.disturbance[2] / m.mass[2] - middle) / m.speed_scale * h
    drive_slope = -m.force_slope / m.mass[0] / m.speed_scale * h * h
    for i in range(STATES):
        k = STATES * i
        free = m.transition[k] * q1 + m.transition[k + 1] * q2 + m.transition[k + 2] * rate1 + m.transition[k + 3] * rate2
        m.relative[i] = free + m.held[k + 2] * drive1 + m.held[k + 3] * drive2 + m.ramp[k + 2] * drive_slope


def accelerations(m: ThreeMassChain) -> None:
    """The accelerations at the present positions, velocities and forces."""
    pull1 = m.stiffness[0] * (m.position[1] - m.position[0]) + m.damping[0] * (m.velocity[1] - m.velocity[0])
    pull2 = m.stiffness[1] * (m.position[2] - m.position[1]) + m.damping[1] * (m.velocity[2] - m.velocity[1])
    m.acceleration[0] = (m.force + m.disturbance[0] + pull1) / m.mass[0]
    m.acceleration[1] = (m.disturbance[1] - pull1 + pull2) / m.mass[1]
    m.acceleration[2] = (m.disturbance[2] - pull2) / m.mass[2]

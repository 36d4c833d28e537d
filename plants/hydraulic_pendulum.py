"""Hydraulic pendulum: a rod hinged on a slide that a servo-hydraulic cylinder moves, nonlinear."""

from __future__ import annotations

import math
from typing import ClassVar

from shaper_fmu.component import Calculated, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.integration import Integrated, integrate
from shaper_fmu.plants.servo_hydraulics import free_speed, makeup, port_flow, relief, resting_pressure, resting_spool
from shaper_fmu.variable import Array

AT_THE_END = 1
CAVITATION = 2
TOO_LEAKY = 3
BAD_RETURN = 4
TOO_LONG = 5

RATED_DROP = 3.5e6
"""Pressure difference over each of the two open edges at which a servo valve's flow is rated [Pa]: 70 bar over both."""

LONGEST_PIECE = 1e-3
"""The ends of the stroke and cavitation are looked for at least this often [s]: far below a hydraulic period."""

LONGEST_STEP = 1000.0
"""Communication steps of more than this are refused: they would take too long to compute [s]."""


class HydraulicPendulum(Integrated):
    """Uniform rod hinged on a slide, which a double-acting cylinder with a servo valve moves under position control.

    With slide position x and swing angle theta (rod hanging down at 0, its centre at l/2, inertia m_p l^2/3 about the hinge):

    - (m_s + m_p) x'' + m_p l/2 (theta'' cos theta - theta'^2 sin theta) + c_x x' = P1 A1 - P2 A2,
    - m_p l^2/3 theta'' + m_p l/2 cos theta x'' + c_p theta' + m_p g l/2 sin theta = 0,
    - V1 P1' = beta (Q1 - A1 x'), V2 P2' = beta (Q2 + A2 x'), V1 = V0 + A1 (S/2 + x), V2 = V0 + A2 (S/2 - x),
    - Q1, Q2: turbulent flow through four matched metering edges, the laminar leakage past the piston, what the make-up
      valves (check valves from the return line) let in while a chamber's pressure is below the return pressure, less what
      the relief valves let out into the return line while it is above theirs,
    - spool: two equal lags in series (second order, critically damped), driven by the limited command
      Kp (reference - x) + the trim that holds the slide at the reference at rest.

    It starts at rest in the middle of the stroke, position 0. Kilic and Kapucu 2011, eqs. (1) and (2), with the inertia of
    a rod for that of a point mass. Local errors are below 1e-10 (m, m/s, rad, rad/s, shares of the full spool displacement
    and of the supply pressure).
    """

    messages: ClassVar[dict[int, str]] = {
        AT_THE_END: "the piston ran into the end of its cylinder: slide_position = {slide_position} m, possible is "
        "half a stroke of {stroke} m either way; move less, or take a longer stroke",
        CAVITATION: "the oil cavitates: the pressure in a chamber fell to {lowest_pressure} Pa (absolute); "
        "move the reference more slowly, or raise return_pressure or makeup_conductance",
        TOO_LEAKY: "with leakage = {leakage} m3/s/Pa the valve cannot hold the slide at rest: "
        "it would have to open {trim} times its full opening",
        BAD_RETURN: "return_pressure = {return_pressure} Pa must be less than supply_pressure = {supply_pressure} Pa",
        TOO_LONG: "a communication step of more than 1000 s is not possible; take shorter ones",
    }
    default_stop_time: ClassVar[float] = 5.0
    default_step_size: ClassVar[float] = 1e-3
    continuous_states: ClassVar[tuple[str, ...] | None] = (
        "slide_position",
        "slide_velocity",
        "swing_angle",
        "swing_rate",
        "relative_pressure",
        "pilot_position",
        "spool_position",
    )
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"position": "reference_position"},
        "plant": {
            "slide_position": "slide_position",
            "slide_velocity": "slide_velocity",
            "swing_angle": "swing_angle",
            "swing_rate": "swing_rate",
            "tip_position": "tip_position",
        },
    }

    reference_position: Variable[float] = Input("m", "reference of the slide's position", slope="reference_slope")
    rod_length: Variable[float] = Parameter(0.485, "m", "length of the rod", min=0.0, exclusive=True, published=(1e-9, None))
    rod_mass: Variable[float] = Parameter(0.43, "kg", "mass of the rod", min=0.0, exclusive=True, published=(1e-9, None))
    hinge_damping: Variable[float] = Parameter(0.0297, "N.m.s/rad", "viscous damping of the hinge", min=0.0)
    gravity: Variable[float] = Parameter(9.81, "m/s2", "acceleration of gravity", min=0.0, exclusive=True, published=(1e-9, None))
    slide_mass: Variable[float] = Parameter(10.0, "kg", "mass of slide and piston", min=0.0, exclusive=True, published=(1e-9, None))
    slide_damping: Variable[float] = Parameter(300.0, "N.s/m", "viscous friction of slide and piston", min=0.0)
    piston_area: Variable[float] = Parameter(
        4.91e-4, "m2", "area A1 on the piston's side", min=0.0, exclusive=True, published=(1e-9, None)
    )
    annulus_area: Variable[float] = Parameter(
        3.77e-4, "m2", "area A2 on the piston rod's side", min=0.0, exclusive=True, published=(1e-9, None)
    )
    stroke: Variable[float] = Parameter(0.6, "m", "stroke of the cylinder", min=0.0, exclusive=True, published=(1e-9, None))
    dead_volume: Variable[float] = Parameter(
        3e-5, "m3", "oil in pipe and chamber at the end of the stroke, each side", min=0.0, exclusive=True, published=(1e-9, None)
    )
    bulk_modulus: Variable[float] = Parameter(
        1.4e9, "Pa", "effective bulk modulus of the oil", min=0.0, exclusive=True, published=(1e-9, None)
    )
    leakage: Variable[float] = Parameter(1e-12, "m3/s/Pa", "laminar leakage past the piston", min=0.0)
    makeup_conductance: Variable[float] = Parameter(
        5e-9, "m3/s/Pa", "flow through a make-up valve per pressure difference, 0 for none", min=0.0
    )
    relief_ratio: Variable[float] = Parameter(
        1.2, "", "pressure at which the relief valves of both chambers open, share of the supply pressure", min=1.0
    )
    relief_conductance: Variable[float] = Parameter(
        2e-10, "m3/s/Pa", "flow through a relief valve per pressure above the one at which it opens, 0 for none", min=0.0
    )
    supply_pressure: Variable[float] = Parameter(
        1e7, "Pa", "supply pressure, absolute", min=0.0, exclusive=True, published=(1e6, None)
    )
    return_pressure: Variable[float] = Parameter(3e5, "Pa", "return pressure, absolute", min=0.0)
    rated_flow: Variable[float] = Parameter(
        3.2e-4, "m3/s", "flow of the fully open valve at 70 bar over both edges", min=0.0, exclusive=True, published=(1e-5, None)
    )
    null_opening: Variable[float] = Parameter(
        0.02, "", "opening of a port's two edges together at mid position", min=0.0, exclusive=True, published=(1e-9, None)
    )
    valve_frequency: Variable[float] = Parameter(
        600.0, "rad/s", "natural frequency of the spool's motion", min=0.0, exclusive=True, published=(1e-9, None)
    )
    proportional_gain: Variable[float] = Parameter(60.0, "1/m", "valve opening per position error", min=0.0)
    natural_frequency: Variable[float] = Calculated(
        "rad/s", "frequency of small undamped swings under the fixed slide, sqrt(3 g / (2 l))"
    )
    damping_ratio: Variable[float] = Calculated("", "damping ratio of these swings")
    hydraulic_frequency: Variable[float] = Calculated("rad/s", "frequency of slide and rod on the oil's springs at position 0")
    extending_speed: Variable[float] = Calculated("m/s", "speed of the unloaded slide at full opening, forwards")
    retracting_speed: Variable[float] = Calculated("m/s", "speed of the unloaded slide at full opening, backwards")
    slide_position: Variable[float] = Output("m", "position of the slide", depends=(), derivative="slide_velocity", nominal=0.01)
    slide_velocity: Variable[float] = Output("m/s", "speed of the slide", depends=(), derivative="slide_acceleration", nominal=0.1)
    swing_angle: Variable[float] = Output(
        "rad",
        "swing angle, positive when the rod's tip is ahead of the slide",
        depends=(),
        display_unit="deg",
        derivative="swing_rate",
        nominal=0.01,
    )
    swing_rate: Variable[float] = Output(
        "rad/s", "rate of the swing angle", depends=(), display_unit="deg/s", derivative="swing_acceleration", nominal=0.1
    )
    tip_position: Variable[float] = Output("m", "horizontal position of the rod's tip", depends=())
    pressure: Variable[list[float]] = Output("Pa", "pressures on the piston's and on the rod's side", size=2, depends=())
    relative_pressure: Variable[list[float]] = Local(
        "", "pressures as shares of the supply pressure", size=2, derivative="relative_pressure_rate", nominal=0.1
    )
    pilot_position: Variable[float] = Local(
        "", "first lag of the spool, share of the full displacement", derivative="pilot_rate", nominal="null_opening"
    )
    spool_position: Variable[float] = Local(
        "", "spool displacement, share of the full one", derivative="spool_rate", nominal="null_opening"
    )
    slide_acceleration: Variable[float] = Local("m/s2", "acceleration of the slide")
    swing_acceleration: Variable[float] = Local("rad/s2", "acceleration of the swing angle")
    relative_pressure_rate: Variable[list[float]] = Local("1/s", "rates of the relative pressures", size=2)
    pilot_rate: Variable[float] = Local("1/s", "rate of the first lag")
    spool_rate: Variable[float] = Local("1/s", "rate of the spool displacement")

    reference_slope: Variable[float] = State(0.0)
    trim: Variable[float] = State(0.0)
    edge_flow: Variable[float] = State(0.0)  # of a fully open edge at the whole supply pressure [m3/s]
    lowest_pressure: Variable[float] = State(0.0)

    def start(self) -> int:
        if self.return_pressure >= self.supply_pressure:
            return BAD_RETURN
        start_pendulum(self)
        start_hydraulics(self)
        if not abs(self.trim) <= 1.0:
            return TOO_LEAKY
        return 0

    def step(self, t: float, h: float) -> int:
        if h > LONGEST_STEP:
            return TOO_LONG
        if h > 0.0:
            pieces = math.ceil(h / LONGEST_PIECE)
            for _ in range(pieces):
                status = advance(self, h / pieces)
                if status:
                    return status
        elif limits(self):  # of a state that a solver has set
            return limits(self)
        gather(self)
        derivatives(self, 0.0, self.x, self.slope)
        self.slide_acceleration = self.slope[1]
        self.swing_acceleration = self.slope[3]
        self.relative_pressure_rate[0] = self.slope[4]
        self.relative_pressure_rate[1] = self.slope[5]
        self.pilot_rate = self.slope[6]
        self.spool_rate = self.slope[7]
        self.pressure[0] = self.relative_pressure[0] * self.supply_pressure
        self.pressure[1] = self.relative_pressure[1] * self.supply_pressure
        self.tip_position = self.slide_position + self.rod_length * math.sin(self.swing_angle)
        return 0


def start_pendulum(m: HydraulicPendulum) -> None:
    """Frequency and damping ratio of the rod under the fixed slide."""
    inertia = m.rod_mass * m.rod_length * m.rod_length / 3.0
    m.natural_frequency = math.sqrt(1.5 * m.gravity / m.rod_length)
    m.damping_ratio = 0.5 * m.hinge_damping / (inertia * m.natural_frequency)


def start_hydraulics(m: HydraulicPendulum) -> None:
    """The state of rest, and what it says about the drive."""
    back = m.return_pressure / m.supply_pressure
    m.edge_flow = m.rated_flow * math.sqrt(m.supply_pressure / RATED_DROP)
    first = resting_pressure(m.piston_area, m.annulus_area, back)
    second = resting_pressure(m.annulus_area, m.piston_area, back)
    leakage = m.leakage * m.supply_pressure * (first - second) / m.edge_flow
    m.trim = resting_spool(m.null_opening, first, back, leakage)
    m.relative_pressure[0] = first
    m.relative_pressure[1] = second
    m.pilot_position = m.trim
    m.spool_position = m.trim
    m.extending_speed = m.edge_flow * free_speed(m.piston_area, m.annulus_area, back)
    m.retracting_speed = m.edge_flow * free_speed(m.annulus_area, m.piston_area, back)
    first_volume = m.dead_volume + 0.5 * m.piston_area * m.stroke
    second_volume = m.dead_volume + 0.5 * m.annulus_area * m.stroke
    oil = m.piston_area * m.piston_area / first_volume + m.annulus_area * m.annulus_area / second_volume
    m.hydraulic_frequency = math.sqrt(m.bulk_modulus * oil / (m.slide_mass + 0.25 * m.rod_mass))


def advance(m: HydraulicPendulum, h: float) -> int:
    """Integrate over h; returns 0 or a status."""
    gather(m)
    status = integrate(m, derivatives, 8, h)
    if status:
        return status
    m.reference_position += m.reference_slope * h
    m.slide_position = m.x[0]
    m.slide_velocity = m.x[1]
    m.swing_angle = m.x[2]
    m.swing_rate = m.x[3]
    m.relative_pressure[0] = m.x[4]
    m.relative_pressure[1] = m.x[5]
    m.pilot_position = m.x[6]
    m.spool_position = m.x[7]
    return limits(m)


def limits(m: HydraulicPendulum) -> int:
    """Whether the equations hold in this state; returns 0 or a status."""
    if abs(m.slide_position) >= 0.5 * m.stroke:
        return AT_THE_END
    m.lowest_pressure = min(m.relative_pressure[0], m.relative_pressure[1]) * m.supply_pressure
    return CAVITATION if m.lowest_pressure < 0.0 else 0


def gather(m: HydraulicPendulum) -> None:
    """The states, pressures in units of the supply pressure, for the integration."""
    m.x[0] = m.slide_position
    m.x[1] = m.slide_velocity
    m.x[2] = m.swing_angle
    m.x[3] = m.swing_rate
    m.x[4] = m.relative_pressure[0]
    m.x[5] = m.relative_pressure[1]
    m.x[6] = m.pilot_position
    m.x[7] = m.spool_position


def derivatives(m: HydraulicPendulum, s: float, x: Array, slope: Array) -> None:
    """Slopes of the states, s after the start of the step."""
    slope[0] = x[1]
    slope[2] = x[3]
    write_motion(m, x, slope)
    write_pressures(m, x, slope)
    command = m.trim + m.proportional_gain * (m.reference_position + m.reference_slope * s - x[0])
    slope[6] = m.valve_frequency * (max(-1.0, min(1.0, command)) - x[6])
    slope[7] = m.valve_frequency * (x[6] - x[7])


def write_motion(m: HydraulicPendulum, x: Array, slope: Array) -> None:
    """Accelerations of slide and rod, from the coupled equations of motion."""
    cosine = math.cos(x[2])
    sine = math.sin(x[2])
    moment = 0.5 * m.rod_mass * m.rod_length
    inertia = m.rod_mass * m.rod_length * m.rod_length / 3.0
    mass = m.slide_mass + m.rod_mass
    coupling = moment * cosine
    push = m.supply_pressure * (x[4] * m.piston_area - x[5] * m.annulus_area)
    force = push - m.slide_damping * x[1] + moment * x[3] * x[3] * sine
    torque = -m.hinge_damping * x[3] - moment * m.gravity * sine
    determinant = mass * inertia - coupling * coupling
    slope[1] = (inertia * force - coupling * torque) / determinant
    slope[3] = (mass * torque - coupling * force) / determinant


def write_pressures(m: HydraulicPendulum, x: Array, slope: Array) -> None:
    """Rates of the pressures, in supply pressures per second."""
    back = m.return_pressure / m.supply_pressure
    leak = m.leakage * m.supply_pressure * (x[4] - x[5])
    check = m.makeup_conductance * m.supply_pressure
    first_flow = m.edge_flow * port_flow(x[7], m.null_opening, x[4], back) + check * makeup(x[4], back) - leak
    second_flow = m.edge_flow * port_flow(-x[7], m.null_opening, x[5], back) + check * makeup(x[5], back) + leak
    first_flow -= m.relief_conductance * m.supply_pressure * relief(x[4], m.relief_ratio)
    second_flow -= m.relief_conductance * m.supply_pressure * relief(x[5], m.relief_ratio)
    first_volume = m.dead_volume + m.piston_area * (0.5 * m.stroke + x[0])
    second_volume = m.dead_volume + m.annulus_area * (0.5 * m.stroke - x[0])
    stiffness = m.bulk_modulus / m.supply_pressure
    slope[4] = stiffness * (first_flow - m.piston_area * x[1]) / first_volume
    slope[5] = stiffness * (second_flow + m.annulus_area * x[1]) / second_volume

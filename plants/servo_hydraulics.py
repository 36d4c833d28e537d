"""Servo valve and double-acting cylinder: flows and pressures, as functions without state.

Pressures are absolute, in units of the supply pressure; flows in units of the flow through one fully open metering edge
at the whole supply pressure; the spool's displacement is a share of the full one. Turbulent orifices: Merritt, Hydraulic
Control Systems, 1967, chapters 3 and 5.
"""

from __future__ import annotations

import math

TURBULENT_FROM = 1e-3
"""Pressure difference, as a share of the supply pressure, around which the flow through an orifice turns from laminar to
turbulent: below it the flow is proportional to the difference, above it to its root. It keeps the equations smooth at zero."""


def root(difference: float) -> float:
    """The signed square root of a pressure difference, made smooth at zero: d / (d^2 + d0^2)^(1/4).

    It falls short of the root by less than 1e-4 of its value from 0.05 on (d0 = 1e-3).
    """
    return difference / math.sqrt(math.sqrt(difference * difference + TURBULENT_FROM * TURBULENT_FROM))


def edge_opening(spool: float, null_opening: float) -> float:
    """Opening of a metering edge (1: fully open) that opens with the spool's displacement, -1 .. 1.

    Half of `null_opening` is open in the middle position, and it closes smoothly beyond: the null leakage of a real valve.
    """
    return 0.5 * (spool + math.sqrt(spool * spool + null_opening * null_opening))


def port_flow(spool: float, null_opening: float, pressure: float, return_pressure: float) -> float:
    """Flow into the cylinder's chamber behind a port that a positive spool displacement connects with the supply.

    Supply and return are connected through the port's two metering edges.
    """
    supplied = edge_opening(spool, null_opening) * root(1.0 - pressure)
    return supplied - edge_opening(-spool, null_opening) * root(pressure - return_pressure)


def makeup(pressure: float, return_pressure: float) -> float:
    """Pressure difference that drives oil through a make-up valve: 0 above the return pressure, and smooth there."""
    return past_valve(return_pressure - pressure)


def relief(pressure: float, cracking_pressure: float) -> float:
    """Pressure difference that drives oil through a relief valve: 0 below its cracking pressure, and smooth there."""
    return past_valve(pressure - cracking_pressure)


def past_valve(excess: float) -> float:
    """What of a pressure beyond a valve's opening pressure drives oil through it: all, short of TURBULENT_FROM; else nothing."""
    if excess <= 0.0:
        return 0.0
    return excess * excess / (excess + TURBULENT_FROM)


def resting_pressure(own_area: float, other_area: float, return_pressure: float) -> float:
    """Pressure in the chamber of `own_area` at rest without load, for a valve with matched, symmetrical edges.

    Both chambers' flows balance where the two pressures add up to supply + return; the forces, where p1 A1 = p2 A2.
    """
    return (1.0 + return_pressure) * other_area / (own_area + other_area)


def resting_spool(null_opening: float, pressure: float, return_pressure: float, leakage: float) -> float:
    """Spool displacement that holds the cylinder at rest, for chamber 1 at `pressure` and a leakage flow out of it.

    With F, G the roots of the pressure differences over the two edges, M = (F + G)/2 and D = (F - G)/2, the flow
    M u + D sqrt(u^2 + u0^2) must equal the leakage: a quadratic equation. Beyond +-1 the valve cannot hold the cylinder.
    """
    supply_root = root(1.0 - pressure)
    return_root = root(pressure - return_pressure)
    product = supply_root * return_root
    mean = 0.5 * (supply_root + return_root)
    half = 0.5 * (supply_root - return_root)
    return (leakage * mean - half * math.sqrt(leakage * leakage + product * null_opening * null_opening)) / product


def free_speed(driven_area: float, other_area: float, return_pressure: float) -> float:
    """Speed of the unloaded, frictionless piston at full opening, pushed from the side of `driven_area`.

    In units of (flow of an edge at supply pressure) / area. From p1 A1 = p2 A2 with p1 = 1 - (A1 w)^2 and p2 = pr + (A2 w)^2.
    """
    push = driven_area - return_pressure * other_area
    if push <= 0.0:
        return 0.0
    return math.sqrt(push / (driven_area * driven_area * driven_area + other_area * other_area * other_area))

"""The position controller: PID with the derivative on the measured velocity, a force limit and no windup."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import Component, Input, Local, Output, Parameter, State, Variable
from shaper_fmu.profiles.limits import NO_LIMIT


class PositionController(Component):
    """Force of a PD or PID position loop: Kp (reference - position) + Ki integral(reference - position) - Kd velocity.

    The derivative part acts on the velocity alone, so that a jump of the reference gives no impulse. The force stays
    within +-force_limit. Against windup the integration is conditional: it never carries the force beyond the limit, and
    stops where a proportional or derivative part already does, unless it leads back. Over a held input the unlimited
    force is a straight line in time, so the integral, and the moment at which it stops, are exact: dividing a step
    changes nothing. (Back-calculation would add a time constant to choose, and its response would depend on it.) Over
    inputs that are linear over the step the integral is exact within the limit; at the limit the step's end decides.
    """

    continuous_states: ClassVar[tuple[str, ...] | None] = ("integral_force",)
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"position": "reference"},
        "plant": {"force": "force", "position": "position", "velocity": "velocity"},
    }

    reference: Variable[float] = Input("m", "position wanted", slope="reference_slope")
    position: Variable[float] = Input("m", "position measured", slope="position_slope")
    velocity: Variable[float] = Input("m/s", "velocity measured", slope="velocity_slope")
    proportional_gain: Variable[float] = Parameter(100.0, "N/m", "force per position error", min=0.0)
    integral_gain: Variable[float] = Parameter(0.0, "N/m/s", "rate of force per position error, 0 for a PD controller", min=0.0)
    derivative_gain: Variable[float] = Parameter(20.0, "N.s/m", "force against the velocity", min=0.0)
    force_limit: Variable[float] = Parameter(
        NO_LIMIT,
        "N",
        "magnitude of the force never to be exceeded, 1e300 for no limit",
        min=0.0,
        exclusive=True,
        published=(1e-9, None),
    )
    force: Variable[float] = Output("N", "force on the plant")
    integral_force: Variable[float] = Local("N", "integral part of the force", derivative="integral_rate")
    integral_rate: Variable[float] = Local("N/s", "rate of the integral part: 0 where the integration stops")

    reference_slope: Variable[float] = State(0.0)
    position_slope: Variable[float] = State(0.0)
    velocity_slope: Variable[float] = State(0.0)

    def step(self, t: float, h: float) -> None:
        added = self.integral_gain * (self.reference - self.position) * h
        added += 0.5 * self.integral_gain * (self.reference_slope - self.position_slope) * h * h
        self.reference += self.reference_slope * h
        self.position += self.position_slope * h
        self.velocity += self.velocity_slope * h
        error = self.reference - self.position
        direct = self.proportional_gain * error - self.derivative_gain * self.velocity
        rate = self.integral_gain * error
        self.integral_force = integrated(self.integral_force, added, direct, self.force_limit)
        total = direct + self.integral_force
        stopped = (rate > 0.0 and total >= self.force_limit) or (rate < 0.0 and total <= -self.force_limit)
        self.integral_rate = 0.0 if stopped else rate
        self.force = max(-self.force_limit, min(self.force_limit, total))


def integrated(integral: float, gain: float, direct: float, limit: float) -> float:
    """The integral part [N] after a step that would add `gain` [N] to it, beside a held `direct` part [N]."""
    if gain > 0.0:
        return min(integral + gain, max(integral, limit - direct))
    return max(integral + gain, min(integral, -limit - direct))

"""The smooth shaper: distributes a command over time, so that it neither jumps nor excites the modes."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import MEAN, NO_EVENT, Calculated, Input, Output, Parameter, State, Variable, time_tolerance
from shaper_fmu.kinds.smoothed_modes import MODES, SmoothedModes, design_smoother
from shaper_fmu.kinds.smoothers import FURTHER_PARAMETERS, LIST, PARAMETERS, Smoother
from shaper_fmu.methods.record import declare
from shaper_fmu.smoothers.edges import (
    EDGES,
    EdgeWorkspace,
    drop_old,
    has_room,
    next_breakpoint,
    put_edge,
    smoothed,
    smoothed_mean,
    smoothed_slope,
    value_at,
)
from shaper_fmu.smoothers.response import duration, mean_delay

HISTORY_FULL = 1
NO_KERNEL = 2


class SmoothShaper(EdgeWorkspace, SmoothedModes):
    __doc__ = f"""Distributes any incoming command over time, so that flexible modes are not excited, and the command does not jump.

    shaped(t) is the integral of k(s) command(t - s), with the kernel k of the chosen smoother for each mode, convolved over
    the modes. The command is held or linear over a step, and what becomes of it is exact at every step: the step response
    of a kernel is made of polynomials, from ramps (order 1) to S-curves. `shaped_slope` is its derivative;
    `next_event_time` announces where the polynomials change for a command that jumps. A master that holds inputs
    over fixed steps wires `shaped_mean`, the mean over the step just done.

    Before the start the command is taken to have been `initial_command` for ever.

    Smoothers:

    - none: the command itself;
    {LIST}.

    `certificate` is the largest residual of the equations that define the kernel.
    """

    messages: ClassVar[dict[int, str]] = {
        HISTORY_FULL: f"the command has changed more than {EDGES - 1} times within the duration {{duration}} s; "
        "use a larger communication step",
        NO_KERNEL: "no {smoother} smoother was found beyond the damping ratio {damping}; choose another one",
    }

    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    sampled: ClassVar[bool] = True
    terminals: ClassVar[dict[str, dict[str, str]]] = {
        "command": {"value": "command"},
        "shaped": {"value": "shaped", "mean": "shaped_mean"},
    }

    command: Variable[float] = Input("", "command to be shaped", slope="command_slope")
    smoother: Variable[int] = Parameter(Smoother.ramped_zv, "", "kind of smoother")
    modes: Variable[int] = Parameter(1, "", "number of modes", min=1, max=MODES)
    natural_frequency: Variable[list[float]] = Parameter(
        10.0,
        "rad/s",
        "undamped natural frequency of each mode",
        size=MODES,
        min=0.0,
        exclusive=True,
        published=(1e-9, None),
    )
    damping_ratio: Variable[list[float]] = Parameter(
        0.0, "", "damping ratio of each mode", size=MODES, min=0.0, max=1.0, exclusive="max", published=(0.0, 0.999)
    )
    declare(locals(), PARAMETERS)
    initial_command: Variable[float] = Parameter(0.0, "", "value of the command before the start")
    duration: Variable[float] = Calculated("s", "how long the response to a step takes")
    mean_delay: Variable[float] = Calculated("s", "how much later a ramp is")
    certificate: Variable[float] = Calculated("", "largest residual of the equations that define the kernel")
    shaped: Variable[float] = Output("", "shaped command")
    shaped_slope: Variable[float] = Output("", "derivative of the shaped command [1/s], without impulses where it jumps")
    shaped_mean: Variable[float] = Output("", MEAN.format("shaped"))
    next_event_time: Variable[float] = Output(
        "s", "time at which the shaped command's next polynomial begins, 1e300 if none", start=NO_EVENT
    )
    settled: Variable[bool] = Output("", "true when nothing more is pending", start=True)

    command_slope: Variable[float] = State(0.0)
    declare(locals(), FURTHER_PARAMETERS)

    def start(self) -> int:
        if not design_smoother(self):
            return NO_KERNEL
        self.duration = duration(self)
        self.mean_delay = mean_delay(self)
        self.edge_value[0] = self.initial_command
        self.shaped = self.initial_command
        self.shaped_mean = self.initial_command
        return 0

    def step(self, t: float, h: float) -> int:
        if self.command != value_at(self, self.newest, t) or self.command_slope != self.edge_slope[self.newest % EDGES]:
            if not has_room(self):
                return HISTORY_FULL
            put_edge(self, t, self.command, self.command_slope)
        until = t + h + time_tolerance(self, t, h)
        if h > 0.0:
            self.shaped_mean = smoothed_mean(self, t, h)
        drop_old(self, until)
        self.shaped = smoothed(self, t + h, until)
        self.shaped_slope = smoothed_slope(self, t + h, until)
        self.next_event_time = next_breakpoint(self, until)
        self.settled = self.base == self.newest and self.command_slope == 0.0
        self.command += self.command_slope * h
        return 0

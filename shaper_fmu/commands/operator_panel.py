"""The operator's panel: buttons that are pressed and released at given times."""

from __future__ import annotations

from typing import ClassVar

from shaper_fmu.component import NO_EVENT, Component, Output, Parameter, Variable, time_tolerance

PRESSES = 16

PRESS_ORDER = 1


class OperatorPanel(Component):
    """A speed that jumps whenever a button is pressed or released, and a stop that is held down for a while, at given times.

    From press_time[i] on the speed is press_speed[i], until the next one; before the first it is 0. `stop` is true from
    stop_time to release_time. All jumps are exact in time.
    """

    messages: ClassVar[dict[int, str]] = {PRESS_ORDER: "press_time must rise over its first {presses} elements"}
    continuous_states: ClassVar[tuple[str, ...] | None] = ()
    default_stop_time: ClassVar[float] = 30.0
    terminals: ClassVar[dict[str, dict[str, str]]] = {"command": {"speed": "speed", "stop": "stop"}}

    presses: Variable[int] = Parameter(1, "", "how often a button is pressed or released", min=0, max=PRESSES)
    press_time: Variable[list[float]] = Parameter(
        [0.5 + 0.5 * i for i in range(PRESSES)], "s", "time at which each speed is commanded", size=PRESSES
    )
    press_speed: Variable[list[float]] = Parameter(
        [1.0] + [0.0] * (PRESSES - 1), "m/s", "speed that is commanded from then on", size=PRESSES
    )
    stop_time: Variable[float] = Parameter(NO_EVENT, "s", "time at which stop is pressed, 1e300 for never")
    release_time: Variable[float] = Parameter(NO_EVENT, "s", "time at which it is released")
    speed: Variable[float] = Output("m/s", "commanded speed")
    stop: Variable[bool] = Output("", "true while stop is pressed", start=False)
    next_event_time: Variable[float] = Output("s", "time of the next jump of an output, 1e300 if none", start=NO_EVENT)

    def start(self) -> int:
        for i in range(1, self.presses):
            if not self.press_time[i] > self.press_time[i - 1]:
                return PRESS_ORDER
        return 0

    def step(self, t: float, h: float) -> None:
        reached = t + h + time_tolerance(self, t, h)
        self.speed = 0.0
        self.next_event_time = NO_EVENT
        for i in range(self.presses):
            if self.press_time[i] <= reached:
                self.speed = self.press_speed[i]
            else:
                self.next_event_time = self.press_time[i]
                break
        self.stop = False
        if self.stop_time <= reached < self.release_time:
            self.stop = True
        for due in (self.stop_time, self.release_time):
            if due > reached:
                self.next_event_time = min(self.next_event_time, due)

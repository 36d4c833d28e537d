"""The numbers by which the loop and Python name things: kinds, operations, faults, answers, functions of FMI."""

from __future__ import annotations

from enum import IntEnum


class ClockKind(IntEnum):
    """Kinds of clocks; the last one is an output."""

    PERIODIC, CHANGING, COUNTDOWN, TRIGGERED, TRIGGERING = range(5)


class Asked(IntEnum):
    """When a clock is asked for its interval: in initialization mode; in event mode, too."""

    NEVER, ONCE, ALWAYS = range(3)


class ValueType(IntEnum):
    """Types of values in memory."""

    F8, F4, I1, U1, I2, U2, I4, U4, I8, U8, BOOLEAN2, BOOLEAN3 = range(12)


class Code(IntEnum):
    """Operations of a program. 2: reals of FMI 1.0 and 2.0, steps of FMI 2.0; KEEP: what has been set, to the bus; AGAIN: what has
    been set before the event."""

    SET2, GET2, STEP2, SET, GET, STEP3, TABLES_BEFORE, TABLES_NOW, HOLD, SLOPES, GUARDED, KEEP, AGAIN, CLOCKED = range(14)
    SOLVE, STEP1 = range(14, 16)


class Fault(IntEnum):
    """What goes wrong. From BAD_INTERVAL on it is about a clock, whose number is the element.

    NOT_A_NUMBER: among the values of a call, whose number is the status. SOLVER: CVODE's answer is the status.
    OTHER_COUNT: a call writes more values than it was asked for, whose number is the status."""

    NO_FAULT, CALL_FAILED, NOT_FINITE, EARLY_RETURN, TERMINATED, ENDLESS_EVENTS, NOT_IN_RANGE, NO_ITEM = range(8)
    NOT_A_NUMBER, SOLVER, ENDLESS_STATE_EVENTS, OPEN_LOOP, OTHER_COUNT = range(8, 13)
    BAD_INTERVAL, NO_INTERVAL, OFF_GRID, ENDLESS_TICKS = range(13, 17)


class Answer(IntEnum):
    """How the loop comes back; FULL: there is no room in the record."""

    GOING_ON, FINISHED, FULL, FAULT = range(4)


class Called(IntEnum):
    """Functions of FMI that are no transfers, by the number that a fault tells; see faults.called_name."""

    DoStep, EnterEventMode, EnterStepMode, UpdateDiscreteStates, SetRealInputDerivatives = range(5)
    Reset, SetupExperiment, EnterInitializationMode, ExitInitializationMode = range(5, 9)
    SetClock, GetClock, GetIntervalDecimal, GetIntervalFraction, GetShiftDecimal, GetShiftFraction = range(9, 15)
    SetTime, SetContinuousStates, GetContinuousStates, GetNominals, GetDerivatives, GetEventIndicators = range(15, 21)
    CompletedIntegratorStep, GetDirectionalDerivative, GetInputs, SetInputs = range(21, 25)


PERIODIC, CHANGING, COUNTDOWN, TRIGGERED, TRIGGERING = ClockKind
ONCE, ALWAYS = Asked.ONCE, Asked.ALWAYS
F8, F4, I1, U1, I2, U2, I4, U4, I8, U8, BOOLEAN2, BOOLEAN3 = ValueType
SIZES: dict[int, int] = {F8: 8, F4: 4, I1: 1, U1: 1, I2: 2, U2: 2, I4: 4, U4: 4, I8: 8, U8: 8, BOOLEAN2: 4, BOOLEAN3: 1}
SET2, GET2, STEP2, SET, GET, STEP3, TABLES_BEFORE, TABLES_NOW, HOLD, SLOPES, GUARDED, KEEP, AGAIN, CLOCKED, SOLVE, STEP1 = Code
NO_FAULT, CALL_FAILED, NOT_FINITE, EARLY_RETURN, TERMINATED, ENDLESS_EVENTS, NOT_IN_RANGE, NO_ITEM = list(Fault)[:8]
NOT_A_NUMBER, SOLVER_FAULT, ENDLESS_STATE_EVENTS, OPEN_LOOP, OTHER_COUNT = list(Fault)[8:13]
BAD_INTERVAL, NO_INTERVAL, OFF_GRID, ENDLESS_TICKS = list(Fault)[13:]
GOING_ON, FINISHED, FULL, FAULT = Answer

JUMPS = -(1 << 30)
"""The cause that stands for jumps of tables; others are places of announced times on the bus, or -1 - instance."""

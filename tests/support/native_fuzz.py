"""Random calls of a native library, legal and illegal ones mixed, judged by native_model.py.

What the model calls illegal must be refused with a status of at least Discard and a message that the logger gets, and must
change nothing; what it calls legal must be done. Where values were set that nothing can judge before they are used, such as
a NaN, both may happen (`tainted`), but an error never comes without a message.
"""

from __future__ import annotations

import math
import re
from ctypes import byref, c_bool, c_byte, c_char_p, c_double, c_int, c_size_t, c_void_p
from dataclasses import replace
from typing import Any

from native_calls import Host, array, signatures
from native_model import ALL, BEFORE, CONTINUOUS, ENDED, EVENT, INITIALIZING, READABLE, STEP, UNKNOWN, Life, Model

ABSENT = "Float32|Int8|Int16|UInt|[GS]etString$|Binary|Clock|Interval|Shift|Partition|Dependenc|DirectionalDer|AdjointDer|Configuration|CancelStep|InputDer"
"""Functions for what our FMUs do not have: whatever the arguments, they are refused."""


class Fuzzer(Model):
    """Random calls of one instance. `foreign` are states of other components, `other_kind` one of this
    component's instance for the other kind of simulation."""

    goes_far = True  # steps of 1e5 s and longer are tried
    shortest = 0.0  # step that is taken [s]

    def __init__(self, host: Host, seed: str, foreign: list[int], other_kind: int):
        super().__init__(host, seed)
        self.foreign, self.other_kind = foreign, other_kind
        self.states: list[tuple[c_void_p, Life, list[bytes] | None]] = []
        self.absent_functions = [name[4:] for name in signatures(host.fmi) if re.search(ABSENT, name)]
        common = [self.enter, self.leave, self.leave, self.terminate, self.reset, self.get, self.get, self.set, self.set, self.save,
                  self.restore, self.drop, self.pack, self.logging, self.absent, self.instantiate, self.output_derivatives]  # fmt: skip
        exchange = [self.enter_event, self.discrete, self.enter_continuous, self.completed, self.set_time, self.set_time,
                    self.get_states, self.get_states, self.set_states]  # fmt: skip
        stepping = [*[self.step] * 6, self.enter_event, self.discrete, self.status if host.fmi == 2 else self.enter_step]
        self.operations = common + (exchange if host.exchange else stepping)
        self.misplaced = stepping if host.exchange else exchange

    def run(self, calls: int) -> None:
        """So many calls, with a simulation from a reset in between that must give what it gave at first."""
        expected = self.host.standard_run()
        self.check("Reset", (), ALL, True, BEFORE)
        while self.calls < calls:
            for _ in range(60):
                self.random.choice(self.misplaced if self.random.random() < 0.05 else self.operations)()
            self.check("Reset", (), ALL, True, BEFORE)
            self.life = Life()
            assert self.host.standard_run() == expected, self.told()
            self.check("Reset", (), ALL, True, BEFORE)
        while self.states:
            self.host.call(self.state_name("Free"), byref(self.states.pop()[0]))

    def absent(self) -> None:
        """A function for what the FMU does not have, with pointers to something."""
        name = self.random.choice(self.absent_functions)
        _, arguments = signatures(self.host.fmi)[f"fmi{self.host.fmi}{name}"]
        given = [(c_byte * 64)() if kind in (c_void_p, c_char_p) else kind(1) for kind in arguments[1:]]
        self.check(name, tuple(given), ALL, False)

    def status(self) -> None:
        """FMI 2 asks for a status by its kind: 0 the last step's, 2 its time, 3 whether it ended the simulation."""
        name, kind = self.random.choice([("GetStatus", 0), ("GetRealStatus", 2), ("GetBooleanStatus", 3), ("GetIntegerStatus", 0)])
        bad = self.defect("null", "kind") if name != "GetIntegerStatus" else "kind"
        place = None if bad == "null" else byref(c_double())
        self.check(name, (1 if bad == "kind" else kind, place), {STEP, ENDED}, not bad and not self.host.exchange)

    # saved states

    def state_name(self, verb: str) -> str:
        return f"{verb}FMUState" if self.host.fmi == 3 else f"{verb}FMUstate"

    def save(self) -> None:
        place, life = c_void_p(), self.life
        bad = self.defect("null", "foreign")
        old = self.random.choice(self.states) if self.states and self.random.random() < 0.3 and not bad else None
        if bad == "foreign":
            place = c_void_p(self.random.choice(self.foreign))
        if life.phase == UNKNOWN or len(self.states) > 5:
            return
        values = self.host.all_values() if life.phase in READABLE and not life.tainted else None
        done = self.check(self.state_name("Get"), (None if bad == "null" else byref(old[0] if old else place),), ALL, not bad)
        if done and old:
            self.states.remove(old)
        if done:
            self.states.append((old[0] if old else place, replace(life), values))

    def restore(self) -> None:
        bad = self.defect("null", "foreign")
        if bad or not self.states:
            wrong = self.random.choice([*self.foreign, self.other_kind]) if bad == "foreign" else None
            self.check(self.state_name("Set"), (wrong,), ALL, False)
            return
        state, life, values = self.random.choice(self.states)
        if self.check(self.state_name("Set"), (state,), ALL):
            self.life = replace(life)
            assert values is None or self.host.all_values() == values, self.told()

    def drop(self) -> None:
        if self.states and self.random.random() < 0.5:
            state, _, _ = self.states.pop(self.random.randrange(len(self.states)))
            assert self.check(self.state_name("Free"), (byref(state),), ALL)
            assert not state.value

    def pack(self) -> None:
        """Serialize a state, and back; or what must not be taken for one."""
        size = c_size_t()
        assert self.check("SerializedFMUStateSize" if self.host.fmi == 3 else "SerializedFMUstateSize", (None, byref(size)), ALL)
        self.check("SerializedFMUStateSize" if self.host.fmi == 3 else "SerializedFMUstateSize", (None, None), ALL, False)
        data, n = (c_byte * size.value)(), size.value
        serialize = self.state_name("Serialize")
        deserialize = "DeserializeFMUState" if self.host.fmi == 3 else "DeSerializeFMUstate"
        if not self.states:
            return
        state, life, values = self.random.choice(self.states)
        for arguments in [
            (None, data, n),
            (state, None, n),
            (state, data, n - 1),
            (state, data, 0),
            (self.random.choice(self.foreign), data, n),
        ]:
            self.check(serialize, arguments, ALL, False)
        assert self.check(serialize, (state, data, n), ALL)
        damaged = (c_byte * n).from_buffer_copy(data)
        damaged[self.random.randrange(n)] ^= 1 << self.random.randrange(7)
        fresh, foreign = c_void_p(), c_void_p(self.random.choice(self.foreign))
        for arguments in [(damaged, n, byref(fresh)), (data, n - 1, byref(fresh)), (data, n + 1, byref(fresh)), (data, 0, byref(fresh)),
                          (None, n, byref(fresh)), (data, n, None), (data, n, byref(foreign))]:  # fmt: skip
            self.check(deserialize, arguments, ALL, False)
        assert not fresh.value
        assert self.check(deserialize, (data, n, byref(fresh)), ALL)
        self.states.append((fresh, replace(life), values))

    # co-simulation

    def step(self) -> None:
        life = self.life
        t, h = life.time, self.random.choice([0.0, 1e-3, 0.05, self.random.uniform(0.001, 0.2)])
        bad = self.defect("back", "ahead", "negative", "nan time", "nan", "infinite", *(["null"] if self.host.fmi == 3 else []))
        t = {"back": t - 0.7, "ahead": t + 0.7, "nan time": math.nan}.get(bad, t)
        h = {"negative": -0.1, "nan": math.nan, "infinite": math.inf}.get(bad, h)
        huge = not bad and self.goes_far and self.random.random() < 0.03
        h = self.random.choice([1e5, 1e30, 1e308]) if huge else h
        unclear = huge or (life.phase == UNKNOWN and bad in ("back", "ahead"))
        legal = False if h < self.shortest else None if unclear else not bad
        if self.host.fmi == 2:
            done = self.check("DoStep", (t, h, 1), {STEP}, legal)
            life.time = t + h if done else life.time
        else:
            event, end, early, last = c_bool(), c_bool(), c_bool(), c_double(life.time)
            places: list[Any] = [byref(event), byref(end), byref(early), byref(last)]
            if bad == "null":
                places[self.random.randrange(4)] = None
            done = self.check("DoStep", (t, h, True, *places), {STEP}, legal)
            life.time = last.value if done else life.time
            assert not done or early.value == (last.value < t + h) or huge, self.told()
        if huge:
            life.phase = UNKNOWN if life.phase == STEP else life.phase

    def enter_step(self) -> None:
        self.check("EnterStepMode", (), {EVENT}, not self.host.exchange, STEP)

    # model exchange, and event mode

    def enter_event(self) -> None:
        phases = {CONTINUOUS} if self.host.exchange else {STEP} if self.host.events else set()
        if self.check("EnterEventMode", (), phases, True, EVENT):
            self.life.event_time = self.life.time

    def discrete(self) -> None:
        bad = self.defect("null")
        if self.host.fmi == 2:
            self.check("NewDiscreteStates", (None if bad else (c_byte * 32)(),), {EVENT}, not bad)
            return
        places: list[Any] = [*[byref(c_bool()) for _ in range(5)], byref(c_double())]
        if bad:
            places[self.random.randrange(6)] = None
        self.check("UpdateDiscreteStates", tuple(places), {EVENT}, not bad)
        self.check("EvaluateDiscreteStates", (), {INITIALIZING, EVENT})

    def enter_continuous(self) -> None:
        self.check("EnterContinuousTimeMode", (), {EVENT}, self.host.exchange, CONTINUOUS)

    def completed(self) -> None:
        bad = self.defect("event", "end")
        flag = c_bool if self.host.fmi == 3 else c_int
        places = (None if bad == "event" else byref(flag()), None if bad == "end" else byref(flag()))
        self.check("CompletedIntegratorStep", (1, *places), {CONTINUOUS}, not bad and self.host.exchange)

    def set_time(self) -> None:
        life = self.life
        if life.phase == EVENT:  # here the two versions differ
            return
        bad = self.defect("nan", "infinite", "back")
        t = {"nan": math.nan, "infinite": math.inf, "back": life.event_time - 0.1}.get(
            bad, life.time + self.random.uniform(0.0, 0.02)
        )
        if self.check(
            "SetTime", (t,), {CONTINUOUS}, None if bad == "back" and life.phase == UNKNOWN else not bad and self.host.exchange
        ):
            life.time = t

    def get_states(self) -> None:
        """Continuous states, their derivatives and nominal values, and event indicators (there are none)."""
        right = self.host.states
        names = {2: ["GetContinuousStates", "GetDerivatives", "GetNominalsOfContinuousStates", "GetEventIndicators"],
                 3: ["GetContinuousStates", "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates", "GetEventIndicators"]}  # fmt: skip
        name = self.random.choice(names[self.host.fmi])
        bad = self.defect("more", "less", "null")
        if name == "GetEventIndicators":
            right, bad = 0, "more" if bad else ""
        n = {"more": right + 1, "less": right - 1}.get(bad, right)
        legal = (not bad or (bad == "null" and n == 0) or n < 0) and self.host.exchange
        values = None if bad == "null" else (c_double * 16)()
        self.check(name, (values, max(n, 0)), READABLE - {STEP}, legal)

    def set_states(self) -> None:
        n, bad = self.host.states, self.defect("more", "null", "nan")
        if bad and n == 0:
            bad = "more"
        values = array(c_double, [self.random.uniform(0.05, 0.25) for _ in range(n + 1)])  # no plant is at an end there
        if bad == "nan":
            values[self.random.randrange(n)] = self.random.choice([math.nan, math.inf])
        legal = not bad and self.host.exchange
        self.check("SetContinuousStates", (None if bad == "null" else values, n + (bad == "more")), {CONTINUOUS}, legal)

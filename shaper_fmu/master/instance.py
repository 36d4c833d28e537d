"""A live instance of an FMU: its calls with checked status, and its log."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Mapping, Sequence
from ctypes import c_void_p, cast
from pathlib import Path
from typing import Any, NamedTuple

import fmpy
from fmpy.fmi1 import FMICallException, fmi1False, fmi1True

from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.description1 import turned
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.functions import LENIENT, lacking, standard_name
from shaper_fmu.master.instance_logs import CALLBACKS1, LOGS, LOGS1, callbacks2, text_of
from shaper_fmu.master.once import occupy, once_key, vacate
from shaper_fmu.master.process_ends import live
from shaper_fmu.master.process_signals import SILENT
from shaper_fmu.master.process_state import Kept, Share, put_back
from shaper_fmu.master.variables import own_start

_FAILED = {
    2: "was refused (Discard)",
    3: "failed",
    4: "failed",
    5: "goes on in the background (Pending), which this master does not support",
}
"""What a status above Warning means, as part of a message."""

_ENDS = ("enterInitializationMode", "exitInitializationMode", "initialize", "reset")
"""Calls after which it is another FMU's turn."""


class EventInfo(NamedTuple):
    """What a model of FMI 1.0 tells when it is initialized: fmiEventInfo."""

    converged: bool
    references_changed: bool
    values_changed: bool
    terminate: bool
    event_defined: bool
    event_time: float


Moment = float | str | None
"""When something happens, for messages: a time [s], or a word such as "initialization"."""


def moment(at: Moment) -> str:
    """The moment as part of a message."""
    return "" if at is None else f" at {at}" if isinstance(at, str) else f" at t = {at:.15g} s"


class Instance:
    """An instantiated FMU. Every failing call raises SimulationError with the instance's name and its last messages.

    `event_mode`: whether an FMU of FMI 3.0 that has event mode is used with it in co-simulation.

    Attributes:
        usable: whether it can be called; not after it was closed, nor after a fatal status.
        fatal: whether it has returned a fatal status, after which FMI allows no call of any instance of this FMU.
        event_info: what a model of FMI 1.0 has told when it was initialized.
        initialized: whether it has been since it was made or reset (FMI 1.0 resets and terminates no other).
    """

    def __init__(self, name: str, fmu: Fmu, event_mode: bool = True):
        self.name: str = name
        self.fmu: Fmu = fmu
        self.log: deque[str] = deque(maxlen=20)
        self.usable: bool = False
        self.fatal: bool = False
        self.initialized: bool = False
        self.event_info: EventInfo | None = None
        self.event_mode: bool = (event_mode or fmu.exchanges_model) and fmu.has_event_mode
        self._arrays: dict[tuple[int, str], list[Any]] = {}  # values of FMI 3.0 arrays, which can be set as a whole only
        self._environment = max(LOGS, default=0) + 1
        self._once = once_key(fmu)
        self.slave: Any = None
        occupy(name, fmu, self._once)
        LOGS[self._environment] = self.log
        live[self._environment] = name, fmu.name, str(fmu.folder)
        try:
            with Kept():
                self._instantiate()
        except BaseException as error:  # fmpy raises bare Exceptions
            if self.slave is not None:
                self.slave.freeLibrary()
            self._leave(freed=True)
            if not isinstance(error, Exception):
                raise
            raise SimulationError(f"{name}: {fmu.name} cannot be instantiated: {self._message(error)}") from None
        self.usable = True
        self._keep_log_quiet()

    def _keep_log_quiet(self) -> None:
        """Errors and warnings are wanted, but not a message for each event: it costs time and pushes the others out."""
        if any(category.name == "logEvents" for category in self.fmu.description.logCategories):
            self.call("setDebugLogging", False, ["logEvents"])

    def _instantiate(self) -> None:
        description, library = self.fmu.description, self._library()
        common = {"modelIdentifier": library.stem, "unzipDirectory": str(self.fmu.folder), "instanceName": self.name}
        self._check_library(library)
        if self.fmu.version == 3:
            self._logger = lambda environment, status, category, message: self.log.append(text_of(message))
            SILENT.add(self._logger.__code__)
            modes = {} if self.fmu.exchanges_model else {"eventModeUsed": self.event_mode, "earlyReturnAllowed": self.event_mode}
            self._load(description.instantiationToken, common)
            self.slave.instantiate(loggingOn=True, logMessage=self._logger, **modes)
            return
        LOGS1[self.name.encode()] = self.log
        if self.fmu.version == 1:
            self._load(description.guid, common)
            self.slave.instantiate(functions=CALLBACKS1, loggingOn=True)
            if not self.slave.component:  # of a slave fmpy does not look
                raise SimulationError("Failed to instantiate")
            LOGS1[self.handle] = self.log
        else:
            self._callbacks = callbacks2(self._environment)
            self._load(description.guid, common)
            self.slave.instantiate(callbacks=self._callbacks, loggingOn=True)

    def _load(self, token: str | None, common: Mapping[str, str]) -> None:
        """Load the library. Raises SimulationError if it lacks a function without which nothing can be run."""
        self.slave = LENIENT[self.fmu.version, self.fmu.exchanges_model](guid=token, **common)
        missing = lacking(self.slave, self.fmu.version, self.fmu.exchanges_model, self.event_mode)
        if missing:
            raise SimulationError(f"its library lacks {'a function' if len(missing) == 1 else 'functions'}: {', '.join(missing)}")

    def _library(self) -> Path:
        """Path of its library for this machine, whether or not it exists."""
        folder = fmpy.platform_tuple if self.fmu.version == 3 else fmpy.platform
        return self.fmu.folder / "binaries" / folder / f"{self.fmu.capabilities.modelIdentifier}{fmpy.sharedLibraryExtension}"

    def _check_library(self, library: Path) -> None:
        """Raise if the FMU has no library for this machine, or one there is cut off: to load it would end the process."""
        if library.is_file():
            problems = self.fmu.library_problems(library.parent)
            if problems:
                raise SimulationError(f"its library {'; '.join(problems)}; get the FMU again, or export it anew")
            return
        others = sorted(path.parent.name for path in library.parents[1].glob("*/*") if path.stem == library.stem)
        found = f"only for {', '.join(others)}" if others else "nor for any other platform"
        raise SimulationError(f"it has no library {library.name} for {library.parent.name}, {found}")

    def _message(self, error: Exception) -> str:
        """The messages of fmpy and the FMU for a failed instantiation."""
        message = str(error)
        if message.startswith("Failed to instantiate"):  # the function has returned NULL
            kinds = {1: ("Slave", "Model"), 2: ("", ""), 3: ("CoSimulation", "ModelExchange")}[self.fmu.version]
            message = standard_name(f"fmi{self.fmu.version}Instantiate{kinds[self.fmu.exchanges_model]} failed")
        words = "; ".join(line for line in [message, *list(self.log)[-3:]] if line)
        refused = self.event_mode and not self.fmu.exchanges_model and "event mode" in words.lower()
        return f"{words}; to do without: system.use_event_mode({self.name!r}, False)" if refused else words

    def call(self, function: str, *arguments: Any, at: Moment = None) -> Any:
        """Call a method of fmpy's slave, such as "reset"."""
        try:
            return getattr(self.slave, function)(*arguments)
        except FMICallException as error:
            raise self.failure(error.function, error.status, at) from None
        finally:
            put_back(Share.FOR_OTHERS if function in _ENDS else Share.ARITHMETIC)

    def enter_initialization(
        self, start_time: float, stop_time: float | None, values: Mapping[str, Any], tolerance: float | None = None
    ) -> None:
        """Set up the experiment with the `tolerance` of the FMU's solver (its default if None), set start values, and enter
        initialization.
        """
        tolerance = tolerance if tolerance is not None else self.fmu.default_tolerance
        if self.fmu.version == 2:
            self.call("setupExperiment", tolerance, start_time, stop_time, at="initialization")
        if self.fmu.structure:  # which a reset takes back, too
            self.call("enterConfigurationMode", at="initialization")
            self.set_values(self.fmu.structure, "initialization")
            self.call("exitConfigurationMode", at="initialization")
        self.set_values(values, "initialization")
        if self.fmu.version == 1:
            self._initialize1(start_time, stop_time, tolerance)
            return
        experiment = (tolerance, start_time, stop_time) if self.fmu.version == 3 else ()
        self.call("enterInitializationMode", *experiment, at="initialization")

    def exit_initialization(self) -> None:
        """Leave initialization mode; FMI 1.0 has none."""
        if self.fmu.version > 1:
            self.call("exitInitializationMode", at="initialization")

    def _initialize1(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        """Initialize an instance of FMI 1.0."""
        self.initialized = True  # so that it is reset if this fails
        if self.fmu.exchanges_model:
            self.call("setTime", start_time, at="initialization")
            controlled = (fmi1True, tolerance) if tolerance is not None else (fmi1False, 0.0)
            self.event_info = EventInfo(*self.call("initialize", *controlled, at="initialization"))
            if self.event_info.terminate:
                said = f": {'; '.join(list(self.log)[-3:])}" if self.log else ""
                raise SimulationError(f"{self.name} at initialization: fmiInitialize asked to end the simulation{said}")
        else:
            self.call("initialize", start_time, stop_time, at="initialization")

    def reset(self) -> None:
        """Bring the instance back to the state after instantiation. Raises SimulationError where the FMU does not do it."""
        if self.fmu.version == 1 and self.fmu.exchanges_model:
            raise SimulationError(f"{self.name}: models of FMI 1.0 cannot be reset")
        if self.fmu.version > 1 or self.initialized:
            self.call("reset", at="reset")
        self.initialized = False
        self._arrays.clear()
        self.log.clear()

    def address(self, function: str) -> int:
        """Address of a function of the FMU's library, by the standard's name; 0 if it does not exist."""
        symbol = f"{self.slave.modelIdentifier}_{function}" if self.fmu.version == 1 else function
        try:
            return cast(self.slave.dll[symbol], c_void_p).value or 0
        except AttributeError:
            return 0

    def entry_points(self) -> tuple[int, ...]:
        """Handle, version, properties and addresses: see layout.INSTANCE."""
        version, exchange = self.fmu.version, self.fmu.exchanges_model
        flags = int(self.event_mode), int(exchange), int(not self.fmu.takes_any_step)
        if version == 1:
            names = ["fmiDoStep", "", "", "", "fmiResetSlave", "", "fmiInitializeSlave", ""]
            names = ["", "", "", "fmiEventUpdate", "", "fmiSetTime", "fmiInitialize", ""] if exchange else names
            return (self.handle, 1, *flags, *[self.address(name) if name else 0 for name in names])
        names = ["" if exchange else f"fmi{version}DoStep", "", "", ""]
        if exchange or version == 3:
            step_mode = f"fmi{version}EnterContinuousTimeMode" if exchange else "fmi3EnterStepMode"
            update = "fmi3UpdateDiscreteStates" if version == 3 else "fmi2NewDiscreteStates"
            names[1:] = [f"fmi{version}EnterEventMode", step_mode, update]
        names += [f"fmi{self.fmu.version}Reset", "fmi2SetupExperiment" if self.fmu.version == 2 else ""]
        names += [f"fmi{self.fmu.version}{verb}InitializationMode" for verb in ("Enter", "Exit")]
        return (self.handle, version, *flags, *[self.address(name) if name else 0 for name in names])

    @property
    def returns_early(self) -> bool:
        """Whether it may end a step at an event that it has not announced."""
        return self.fmu.exchanges_model or (
            self.event_mode and bool(getattr(self.fmu.capabilities, "mightReturnEarlyFromDoStep", False))
        )

    @property
    def handle(self) -> int:
        """What its functions are given."""
        component = self.slave.component
        return int(component.value if hasattr(component, "value") else component)

    def failure(self, function: str, status: int, at: Moment = None) -> SimulationError:
        """The error to raise for a failed call; a fatal one leaves the instance unusable."""
        self.fatal = self.fatal or status == 4
        self.usable = self.usable and not self.fatal
        logged = [text.removeprefix("Fatal py exception encountered: ").split("PyObject_CallMethod\n")[-1] for text in self.log]
        reasons = f": {'; '.join(logged[-3:])}" if logged else ""
        function = standard_name(function)
        verb = _FAILED.get(status, f"returned {status}, which is not a status")
        end = " (Fatal: it cannot be used any more)" if status == 4 else ""
        return SimulationError(f"{self.name}{moment(at)}: {function} {verb}{reasons or ' and gave no message'}{end}")

    def start_value(self, name: str) -> float | int | bool:
        """The value that an element has been set to, or its start value."""
        variable = self.fmu.variables[name]
        elements = self.fmu.elements_with(name)
        key = (variable.valueReference, str(variable.type))
        if key in self._arrays:
            return self._arrays[key][elements.index(name)]
        return own_start(variable, self.name)

    def set_values(self, values: Mapping[str, float | int | bool], at: Moment = None) -> None:
        """Set variables by name. Of an FMI 3.0 array, elements that are not given keep what they were set to before."""
        groups: dict[str, tuple[list[int], list[Any]]] = {}
        for reference, elements in self.fmu.whole_variables(values):
            whole = [values[name] if name in values else self.start_value(name) for name in elements]
            whole = [turned(self.fmu.variables[name], value) for name, value in zip(elements, whole, strict=True)]
            if self.fmu.version == 3:
                self._arrays[reference, str(self.fmu.variables[elements[0]].type)] = whole
            function = f"set{self._type_of(elements[0])}"
            references, flat = groups.setdefault(function, ([], []))
            references.append(reference)
            flat += whole
        for function, (references, flat) in groups.items():
            if self.fmu.version == 1:
                self._check_aliases(references, flat, [name for name in values if function == f"set{self._type_of(name)}"])
            self.call(function, references, flat, at=at)

    def _check_aliases(self, references: Sequence[int], flat: Sequence[Any], names: Sequence[str]) -> None:
        """Raise ModelError for aliases that are given values that contradict each other."""
        found: dict[int, Any] = {}
        for reference, value in zip(references, flat, strict=True):
            if found.setdefault(reference, value) != value:
                same = [name for name in names if self.fmu.variables[name].valueReference == reference]
                raise ModelError([f"{self.name}: {' and '.join(same)} are aliases, and cannot be set to values that differ"])

    def get_values(self, names: Sequence[str]) -> list[Any]:
        """Values of variables by name."""
        found: dict[str, Any] = {}
        for reference, elements in self.fmu.whole_variables(names):
            get = getattr(self.slave, f"get{self._type_of(elements[0])}")
            try:
                values = get([reference], len(elements)) if self.fmu.version == 3 else get([reference])
            except FMICallException as error:
                raise self.failure(error.function, error.status) from None
            finally:
                put_back(Share.ARITHMETIC)
            found.update({name: turned(self.fmu.variables[name], value) for name, value in zip(elements, values, strict=True)})
        return [found[name] for name in names]

    def _type_of(self, name: str) -> str:
        kind = str(self.fmu.variables[name].type)
        if kind in ("String", "Binary", "Clock"):
            raise ModelError([f"{self.name}.{name} is of type {kind}; only numbers and booleans can be transferred"])
        if kind == "Enumeration":
            return "Int64" if self.fmu.version == 3 else "Integer"
        return kind

    @property
    def takes_input_derivatives(self) -> bool:
        """Whether it accepts the time derivative of an input over a step (FMI 1.0 and 2.0)."""
        return bool(getattr(self.fmu.capabilities, "canInterpolateInputs", False)) and self.address(self.input_derivatives) != 0

    @property
    def input_derivatives(self) -> str:
        """The function that takes the time derivatives of inputs; FMI 3.0 has none."""
        return standard_name(f"fmi{self.fmu.version}SetRealInputDerivatives")

    def can_save_states(self) -> bool:
        """Whether the FMU saves and restores its state."""
        capabilities = self.fmu.capabilities
        return bool(getattr(capabilities, "canGetAndSetFMUState", False) or getattr(capabilities, "canGetAndSetFMUstate", False))

    def save_state(self) -> Any:
        """The FMU's state, to be restored and freed."""
        return self._of_state("get")

    def restore_state(self, state: Any) -> None:
        """Bring the FMU back to a saved state."""
        self._of_state("set", state)

    def free_state(self, state: Any) -> None:
        """Forget a saved state."""
        self._of_state("free", state)

    def _of_state(self, verb: str, *state: Any) -> Any:
        try:
            return getattr(self.slave, f"{verb}FMU{'State' if self.fmu.version == 3 else 'state'}")(*state)
        except FMICallException as error:
            raise self.failure(error.function, error.status) from None
        finally:
            put_back(Share.ARITHMETIC)

    def close(self) -> None:
        """Free the instance; after a fatal status it is not freed, since FMI forbids it."""
        freed, self.usable = self.usable, False
        with Kept(last=True):
            if freed:
                if self.fmu.version == 1 and self.initialized:
                    with contextlib.suppress(SimulationError):
                        self.call("terminate")
                self.slave.freeInstance()
        self._leave(freed)

    def _leave(self, freed: bool) -> None:
        for key in [key for key, log in LOGS1.items() if log is self.log]:
            del LOGS1[key]
        live.pop(self._environment, None)
        if LOGS.pop(self._environment, None) is not None:  # else it was closed before
            vacate(self.name, self._once, self._library(), freed)

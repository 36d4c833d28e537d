"""What the tests share: the built FMUs, and a small component of a user's own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # the processes that tests start compile our modules once, not each time
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: more would spin, waiting for each other's core

import pytest
from hypothesis import Phase, settings

import shaper_fmu
from shaper_fmu.component import Component
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import components, load_components

# Not Phase.explain: it traces by sys.settrace, in which CPython 3.11 can spin without end in a process with other threads,
# such as a worker of pytest-xdist: its eval_breaker stays set, and DO_TRACING goes back to RESUME each time.
PHASES = [Phase.explicit, Phase.reuse, Phase.generate, Phase.target, Phase.shrink]
settings.register_profile("development", deadline=None, phases=PHASES)
settings.register_profile("ci", deadline=None, phases=PHASES, derandomize=True)  # the same examples in every run
signal.signal(signal.SIGINT, signal.default_int_handler)  # programs started in the background ignore it, and theirs would, too
settings.load_profile("ci" if os.environ.get("CI") else "development")


REPRESENTATIVES = {"InputShaper", "MassSpringDamper", "OverheadCrane"}
"""Sampled with events, propagated exactly, integrated: the components that `make test` runs of the tests over all."""
THOROUGH = {
    "test_cli_reproduce.py", "test_dist.py", "test_loop_sanitized.py", "test_native_interoperability.py", "test_native_platforms.py", "test_native_robustness.py",
    "test_native_sanitized.py", "test_native_solver_order.py", "test_native_sources.py", "test_portable_systems.py", "test_published_bounds.py", "test_reproduce_partial_modes.py",
    "test_reproduce_pwm.py", "test_reproduce_s_curve.py", "test_reproduce_two_part.py", "test_ssp_portable.py", "test_sweep_killed.py",
    "test_tune_records.py", "test_unknown_parameters.py",
}  # fmt: skip
"""Files of tests that `make test` leaves to `make test-all`: platforms, sanitizers, the wheel, other masters, papers, families."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what `make test` leaves out: whole files, and all but the representatives of what is tested over many values."""
    others = set(components()) - REPRESENTATIVES
    for item in items:
        params = item.callspec.params if isinstance(item, pytest.Function) and hasattr(item, "callspec") else {}
        named = {getattr(value, "__name__", value) for value in params.values() if isinstance(value, str | type)}
        kept = {name: values for mark in item.iter_markers("representatives") for name, values in mark.kwargs.items()}
        if item.path.name in THOROUGH or named & others or any(params[name] not in values for name, values in kept.items()):
            item.add_marker(pytest.mark.thorough)
    _check_representatives(config, items)


def _check_representatives(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Representatives that are none of the values would take a test out of `make test` in silence."""
    if any("::" in argument for argument in config.args):
        return  # single values were asked for
    chosen = {item.nodeid.split("[")[0] for item in items if item.get_closest_marker("representatives")}
    first_tier = {item.nodeid.split("[")[0] for item in items if not item.get_closest_marker("thorough")}
    if chosen - first_tier:
        raise pytest.UsageError(f"none of the representatives is among the values of {', '.join(sorted(chosen - first_tier))}")


def pytest_configure(config: pytest.Config) -> None:
    """The package under test is this checkout's: here, and in the processes that tests start in other folders."""
    if os.environ.get("PYTEST_XDIST_WORKER"):
        return  # the first process has looked
    own = Path(__file__).parents[1] / "shaper_fmu" / "__init__.py"
    code = "from importlib.util import find_spec; spec = find_spec('shaper_fmu'); print(spec and spec.origin)"
    started = subprocess.run([sys.executable, "-c", code], cwd="/", capture_output=True, text=True, check=True).stdout.strip()
    for where, found in (("here", str(shaper_fmu.__file__)), ("in processes that tests start", started)):
        if not Path(found).exists() or not own.samefile(found):
            raise pytest.UsageError(f"tests are of {own}, but `import shaper_fmu` {where} finds {found}: pip install --editable .")


def _built(tmp_path_factory: pytest.TempPathFactory, name: str, **options: Any) -> Path:
    """A folder with the FMUs of all components, which the workers share: each begins at another end, and finds what others have built."""
    base, worker = tmp_path_factory.getbasetemp(), os.environ.get("PYTEST_XDIST_WORKER")
    shared = worker and base.name == f"popen-{worker}"  # not in a run that a worker's test has started
    folder = (base.parent if shared else base) / name
    for component in list(components().values())[:: -1 if worker and int(worker[2:]) % 2 else 1]:
        if not (folder / f"{component.__name__}.fmu").exists():  # written at once when it is complete
            build_fmu(component, folder, **options)
    return folder


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the native FMUs of all components, FMI 2.0, for this machine."""
    return _built(tmp_path_factory, "fmus", platforms=["this"])


@pytest.fixture(scope="session")
def python_fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same by the python backend."""
    return _built(tmp_path_factory, "python_fmus", backend="python")


GAIN = '''\
"""A gain, as a user would write it."""

from shaper_fmu.component import Component, Input, Output, Parameter


class Gain(Component):
    """Multiplies its input: result = {factor} factor value."""

    messages = {{7: "a load of 100% is too much for %s, value = {{value}}"}}

    value = Input("", "what comes in")
    factor = Parameter(1.0, "", "gain")
    result = Output("", "what goes out")

    def step(self, t, h):
        if self.value > 1000.0:
            return 7
        self.result = {factor} * self.factor * self.value
'''


def gain_component(folder: Path, factor: float) -> type[Component]:
    """The component of a file gain.py in this folder that multiplies by `factor`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "gain.py").write_text(GAIN.format(factor=factor))
    return load_components(folder / "gain.py")[0]

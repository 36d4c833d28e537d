"""The command `shaper-fmu wrap`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shaper_fmu.cli.arguments import damping_ratio, finite, input_file, output_file, pairs, rate, share, wrong_usage
from shaper_fmu.cli.frequencies import Frequencies, natural_frequencies
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.pack import Fmi, check_platforms, print_packed
from shaper_fmu.console import err, out

if TYPE_CHECKING:
    from shaper_fmu.tune.tuned_shaper import TunedShaper

_WITHOUT_FREQUENCY = ("none", "custom")


def wrap(
    plant: Annotated[Path, typer.Argument(help="The plant (.fmu).", callback=input_file(".fmu"))],
    inputs: Annotated[
        list[str] | None, typer.Option("--input", help="An input of the plant that is shaped; may be repeated.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="The FMU to write. Default: <plant>_shaped.fmu.", callback=output_file(".fmu"))
    ] = None,
    shaper: Annotated[str | None, typer.Option(help="Shaper: none, zv, zvd, zvdd, zvddd, ei, ... Default: zv.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="A parameter of the shaper, such as natural_frequency=4.6 or, for two modes, =4.6,21.5; may be repeated."
        ),
    ] = None,
    frequency: Frequencies = None,
    tuned: Annotated[
        Path | None,
        typer.Option(
            help="The tuning.json of `tune`, with the input, the shaper and its parameters.", callback=input_file(".json")
        ),
    ] = None,
    fmi: Annotated[Fmi | None, typer.Option(help="Version of FMI outside. Default: the plant's.")] = None,
    platforms: Annotated[
        list[str] | None,
        typer.Option("--platform", help="Platform such as x86_64-windows, or `this`; may be repeated. Default: the plant's."),
    ] = None,
    force: Force = False,
) -> None:
    """Write an FMU that replaces a plant's FMU: the same interface, with some of its inputs shaped.

    All variables of the plant are there, under their names; the shaper's parameters are beside them, as shaper.natural_frequency[1]
    and so on, so that they can be changed where the FMU is used. With the shaper `none` its values are the plant's own.
    The exit code is 1 if --tuned is not proven to hold; the FMU is written with a caveat then.

    \b
    Examples:
        shaper-fmu wrap crane.fmu --input trolley_acceleration --shaper zvd --set natural_frequency=1.4
        shaper-fmu wrap crane.fmu --tuned crane_tuned/tuning.json
    """
    from shaper_fmu.container.wrap import check_inputs, other_starts, wrapped_system
    from shaper_fmu.container.wrap import wrap as write
    from shaper_fmu.master.fmu import load_fmu
    from shaper_fmu.tune.tuned_shaper import read_tuned_shaper

    target: Path = output_file(".fmu")(output or Path(f"{plant.stem}_shaped.fmu"))
    if target.exists() and target.samefile(plant):
        raise typer.BadParameter(f"{plant} is the plant itself: give the wrapped one another name", param_hint="--output")
    check_kept(target, force, "--output")
    check_platforms(platforms)
    found = read_tuned_shaper(tuned) if tuned is not None else None
    names = inputs or ([found.input] if found is not None and found.input else [])
    given = pairs(settings, "--set", "natural_frequency=4.6")
    natural_frequencies([1.0 for name in given if name.partition("[")[0] == "natural_frequency"], frequency)
    if frequency:
        given["natural_frequency"] = ",".join(repr(one) for one in natural_frequencies(None, frequency))
    values = _values(shaper, given, found)
    fmu = load_fmu(plant)
    with wrong_usage("--input"):
        check_inputs(fmu, names)
    if found is not None:
        other = [] if Path(found.source).stem == plant.stem else [f"the tuning is of {found.source}"]
        for note in (*other, *other_starts(fmu, found.settings)):
            err.print(f"note: {note}")
    version = int(fmi) if fmi is not None else max(2, fmu.version)
    with wrong_usage("--shaper or --set"):
        system = wrapped_system(fmu, names, values, version)
    _check_frequency(values)
    packed = write(
        fmu, names, target, values, fmi=version, description=_description(plant, names, found),
        platforms=platforms or (), progress=lambda what: err.print(f"{what} ..."),
    )  # fmt: skip
    print_packed(packed, system, version)
    if found is not None and not found.good:
        out.print(f"{found.caveat or 'not good'}: {found.words}")
        raise typer.Exit(1)


def _values(shaper: str | None, given: dict[str, str], found: TunedShaper | None) -> dict[str, Any]:
    """Start values of the shaper. Several numbers are those of the modes, which are then so many."""
    values: dict[str, Any] = dict(found.start_values) if found is not None else {"shaper": "zv"}
    if shaper is not None:
        values["shaper"] = shaper
    for name, text in given.items():
        parts = _numbers(name, text)
        values[name] = parts if len(parts) > 1 or name in ("natural_frequency", "damping_ratio") else parts[0]
    frequencies = values.get("natural_frequency")
    if isinstance(frequencies, list) and len(frequencies) > 1:
        values.setdefault("modes", len(frequencies))
    return values


def _numbers(name: str, text: str) -> list[Any]:
    """The parts of a value, frequencies and shares as numbers in their units.

    Raises BadParameter for numbers with which the shaper would refuse to start where the FMU is used.
    """
    parse = {"natural_frequency": rate, "damping_ratio": damping_ratio, "vibration_tolerance": share}.get(name.partition("[")[0])
    found: list[Any] = []
    for part in text.split(","):
        try:
            if parse is None and part.strip().lower().lstrip("+-") in ("nan", "inf", "infinity"):
                finite(part)
            found.append(parse(part) if parse is not None else part)
        except typer.BadParameter as error:
            raise typer.BadParameter(f"{name}: {error.message}", param_hint="--set") from None
    return found


def _check_frequency(values: dict[str, Any]) -> None:
    """Raise BadParameter if the shaper is one for a mode, and no frequency is given. After the names have been checked."""
    known = any(name.partition("[")[0] == "natural_frequency" for name in values)
    if not known and values["shaper"] not in _WITHOUT_FREQUENCY:
        message = f"the shaper {values['shaper']} needs --set natural_frequency=... [rad/s], --frequency [Hz], or --tuned"
        raise typer.BadParameter(message, param_hint="--set")


def _description(plant: Path, names: list[str], found: TunedShaper | None) -> str:
    caveat = f"{found.caveat}. " if found is not None and found.caveat else ""
    by = f" by {found.name}" if found is not None else ""
    return f"{caveat}{plant.name} with {' and '.join(names)} shaped{by}."

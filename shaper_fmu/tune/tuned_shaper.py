"""Reads the shaper that a tuning recommends from its tuning.json."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shaper_fmu.archives import read_file
from shaper_fmu.errors import ModelError
from shaper_fmu.tune.tuning_json import SCHEMA


@dataclass(frozen=True)
class TunedShaper:
    """A recommended shaper.

    Attributes:
        name: in words, such as "ZVD on 4.65 rad/s".
        start_values: of an InputShaper.
        input: the plant's input that it is for; "" if the modes are of measured data.
        source: the plant's file.
        good: whether nothing more is to be done.
        words: the tuning's result.
        caveat: what has to be known with it; "" if it is good.
        settings: start values of the plant that it is for, where they were given.
    """

    name: str
    start_values: dict[str, Any]
    input: str
    source: str
    good: bool
    words: str
    caveat: str
    settings: dict[str, Any]


def read_tuned_shaper(path: Path | str) -> TunedShaper:
    """The shaper in a file that `write_json` has written. Raises ModelError if it is none, or recommends no shaper."""
    path = Path(path)
    try:
        found = json.loads(read_file(path))
        if found["schema"] != SCHEMA:
            raise ModelError([f"{path.name}: its layout is {found['schema']}; this version reads {SCHEMA}: tune again"])
        choice = found["choice"]
        recommended = choice["recommended"] if choice is not None else None
        if recommended is None:
            raise ModelError([f"{path.name} recommends no shaper: {found['words']}"])
        if recommended["profile"] is not None:
            raise ModelError([f"{path.name} recommends {recommended['name']}, which is a motion and not only a shaper"])
        return TunedShaper(
            name=str(recommended["name"]),
            start_values=dict(recommended["start_values"]),
            input=str(found["input"] or ""),
            source=str(found["source"]),
            good=bool(found["good"]),
            words=str(found["words"]),
            caveat=str(found["caveat"] or ""),
            settings=dict(found.get("settings") or {}),  # older files have none
        )
    except (ValueError, KeyError, TypeError) as error:
        why = f"it has no {error.args[0]!r}" if isinstance(error, KeyError) else str(error)
        raise ModelError([f"{path.name} is not a tuning.json that 'shaper-fmu tune' has written: {why}"]) from None

"""Which call has written a file, so that the same call may write it again, and another one does not in silence.

A record of each file is in the cache folder, by the file's path: the call's words, and the content's hash. Where there is none, as
after the cache was deleted, the file counts as another call's.
"""

from __future__ import annotations

import hashlib
import json
import sys
from contextlib import suppress
from pathlib import Path

from shaper_fmu.archives import write_file
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.export.cache import cache_folder

_FORCE = "--force"
_BLOCK = 1 << 20


def this_call() -> list[str]:
    """The words of this command, and the folder in which it was given."""
    return [*(word for word in sys.argv[1:] if word != _FORCE), str(Path.cwd())]


def note_written(path: Path, call: list[str]) -> None:
    """Keep that a call has written a file. Where nothing can be kept, the next call needs --force."""
    with suppress(OSError, ShaperFmuError):
        write_file(_record(path), json.dumps({"call": call, "digest": _digest(path)}).encode())


def known_call(path: Path) -> list[str] | None:
    """The call that has written a file, if it is as that call left it."""
    try:
        found = json.loads(_record(path).read_bytes())
        return list(found["call"]) if found["digest"] == _digest(path) else None
    except (OSError, ValueError, KeyError, TypeError, ShaperFmuError):
        return None


def _record(path: Path) -> Path:
    return cache_folder() / "written" / f"{hashlib.sha256(str(path.resolve()).encode(errors='surrogateescape')).hexdigest()}.json"


def _digest(path: Path) -> str:
    found = hashlib.sha256()
    with open(path, "rb") as stream:
        while block := stream.read(_BLOCK):
            found.update(block)
    return found.hexdigest()

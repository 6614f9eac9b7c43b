"""The kernels compiled with AddressSanitizer and UndefinedBehaviorSanitizer, and Python with them.

The sanitizers see an array that NumPy made from the allocator on: a read or write beyond its end
stops the process with a report.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_COMPILER = "gcc"
_FLAGS = [
    *("-g", "-O1", "-fno-omit-frame-pointer", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
]
# Put in place of the installed library before any caller has taken it.
_WITH_LIBRARY = """
import ctypes, sys
from excite_cli.kernels import compiled
compiled.KERNELS = compiled.Kernels(ctypes.CDLL({library!r}))
"""


def sources() -> list[str]:
    """The C files that the package is built from."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (kernels,) = project["tool"]["setuptools"]["ext-modules"]
    return list(kernels["sources"])


def runtime() -> list[str]:
    """What must be loaded before Python is; empty where the compiler has no AddressSanitizer.

    The library of C++ goes with it, so that exceptions within Pinocchio find their way through.
    """
    if shutil.which(_COMPILER) is None:
        return []
    found = [
        subprocess.run(
            [_COMPILER, f"-print-file-name={name}"], capture_output=True, text=True, check=True
        ).stdout.strip()
        for name in ("libasan.so", "libstdc++.so.6")
    ]
    return found if all(map(os.path.isabs, found)) else []


def compiled(folder: Path) -> Path:
    """Compile the kernels into `folder`; a warning is an error."""
    library = folder / "kernels_sanitized.so"
    command = [_COMPILER, *_FLAGS, "-o", str(library), *sources(), "-lm"]
    subprocess.run(command, cwd=ROOT, check=True)
    return library


def python(library: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run `code` in a new interpreter with this library for its kernels."""
    options = {
        "LD_PRELOAD": " ".join(runtime()),
        # Leaks are the interpreter's own; the rest is what other libraries do.
        "ASAN_OPTIONS": "detect_leaks=0:alloc_dealloc_mismatch=0:detect_odr_violation=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    return subprocess.run(
        [sys.executable, "-c", _WITH_LIBRARY.format(library=str(library)) + code],
        cwd=ROOT,
        env={**os.environ, **options},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )

"""What a process of its own needs that reads an untrusted file in place of this one.

The libraries that read meshes and robots in C can be led by a damaged file to end their process, to
fill memory or to run on; nothing in the same process can hold them then.
"""

import contextlib
import os
import signal
import sys

from excite_cli.measurement.memory_limit import address_space

# Threads of linear algebra, of no use here, reserve much of the memory that there is.
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")}


# Beginnings of names of variables.
_NEEDED = ("PATH", "HOME", "LANG", "LC_", "TMP", "TEMP", "XDG_CACHE_HOME", "PYTHON", "VIRTUAL_ENV",
           "LD_LIBRARY_PATH", "DYLD_", "SYSTEMROOT", "ROS_DISTRO", "ROS_VERSION")  # fmt: skip


def command(module: str) -> list[str]:
    """Words that start Python on `module`'s function `serve`.

    With this process's path of imports, so that a checkout finds itself; never (-P) with the
    current folder, where anything may lie.
    """
    boot = f"import sys; sys.path[:] = sys.argv[1:]; from {module} import serve; serve()"
    return [sys.executable, "-P", "-c", boot, *sys.path]


def environment(few: bool = False) -> dict[str, str]:
    """That of this process, with one thread for linear algebra.

    few: of it only what Python needs, and what a robot's file may ask for.
    """
    known = {k: v for k, v in os.environ.items() if not few or k.startswith(_NEEDED)}
    return {**known, **ONE_THREAD}


def limit_memory(most: int) -> None:
    """Of what this process may take beyond what it has [bytes]; where there is no limit, none."""
    try:
        import resource
    except ImportError:
        return
    limits = [(resource.RLIMIT_CORE, 0)]
    if (taken := address_space()) is not None:
        limits.append((resource.RLIMIT_AS, taken + most))
    for kind, value in limits:
        with contextlib.suppress(ValueError, OSError):  # a lower one holds already
            resource.setrlimit(kind, (value, value))


def set_alarm(seconds: float) -> None:
    """End this process once it has computed for so long; 0: not."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


# How a process ends by that alarm, or by being killed for taking too long.
OUT_OF_TIME = (-27, -9)

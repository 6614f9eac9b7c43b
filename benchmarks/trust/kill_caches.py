"""Killing a process while it fills the caches of capsules and of tables."""

import os
import re
import signal
import time
from pathlib import Path

import numpy as np

from benchmarks.trust.kill_trial import Tally

_KEY, _OTHER = "0" * 32, "1" * 32
_LONGEST = 0.15  # s
_LEFT = re.compile(r"\.meshes-[01]+\.npz\.(lock|[a-z0-9_]{8}\.part)")


def kill_caches(folder: Path, kills: int, seed: int) -> Tally:
    """Kill `kills` processes that write both caches in turn; what is read is whole or nothing."""
    from excite_cli.disk_cache import store_arrays, stored_arrays
    from excite_cli.geometry.capsules import store_capsules, stored_capsules
    from excite_cli.robot.capsule import Capsule

    rng, tally = np.random.default_rng(seed), Tally()
    ends = rng.normal(size=(300, 2, 3))
    capsules = [Capsule(f"link{i}", i, a, b, 0.1, (f"link{i}",)) for i, (a, b) in enumerate(ends)]
    arrays = {"values": rng.normal(size=(200, 200)), "axis": np.arange(9.0)}
    os.environ["XDG_CACHE_HOME"] = str(folder)
    inner = folder / "excite"
    for _ in range(kills):
        process = os.fork()
        if not process:
            while True:
                store_capsules(_OTHER, capsules)
                store_arrays(_KEY, arrays)
                for each in inner.glob("m*"):
                    each.unlink()
        time.sleep(float(rng.uniform(0.0, _LONGEST)))
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        tally.kills += 1
        found, read = stored_capsules(_OTHER, 0), stored_arrays(_KEY)
        paths = (inner / f"meshes-{_OTHER}.npz", inner / f"meshes-{_KEY}.npz")
        for path, content in zip(paths, (found, read), strict=True):
            if path.exists() and content is None:
                tally.broken.append(f"{path.name} is broken")
        whole = [each is not None for each in (found, read)]
        state = "absent" if not any(whole) else "new" if all(whole) else "mixed"
        tally.states[state] = tally.states.get(state, 0) + 1
        if read is not None and any((read[name] != arrays[name]).any() for name in arrays):
            tally.broken.append("the table has other numbers")
        if found is not None and any(
            (a.start != b.start).any() for a, b in zip(found, capsules, strict=True)
        ):
            tally.broken.append("the capsules have other numbers")
        left = (
            [each.name for each in inner.iterdir() if each.name.startswith(".")]
            if inner.exists()
            else []
        )
        tally.writing += any(name.endswith(".part") for name in left)
        tally.broken += [f"{name} was left" for name in left if not _LEFT.fullmatch(name)]
    left = len(list(inner.glob(".*.part")))
    store_capsules(_OTHER, capsules)
    store_arrays(_KEY, arrays)
    over = [each.name for each in inner.iterdir() if each.name.startswith(".")]
    if over or stored_capsules(_OTHER, 0) is None or stored_arrays(_KEY) is None:
        tally.broken.append(f"left after the last run: {', '.join(over)}")
    tally.swept, tally.finished = left, 1
    return tally

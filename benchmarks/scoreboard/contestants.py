"""Tools as processes of their own: what each answers, its processor time, lines a user writes."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.program import EXCITE as EXCITE_PROGRAM
from benchmarks.program import Ended, ran
from benchmarks.scoreboard.case import Case
from benchmarks.scoreboard.exchange import lines_of_user, read_answer
from benchmarks.scoreboard.judge import Judge, Verdict

FOLDER = Path(__file__).parent
EXCITE, BODIES = "excite", "excite, bodies that can be"
FIGAROH, TOLD, SYSID = "FIGAROH", "FIGAROH, coupling told", "mujoco.sysid"
WLS, URDF = "least squares", "URDF untouched"
_LONGEST = 1800  # [s] of one tool on one log
# What does better on the held-out data is taken: FIGAROH's decimation by 10 or none, steps of
# mujoco.sysid as they are or scaled by its Jacobian.
_FIGAROH_WAYS = (("10", "10"), ("10", "1"))
_SYSID_WAYS: tuple[tuple[str, ...], ...] = ((), ("jac",))


@dataclass(frozen=True)
class Tool:
    """A driver, the interpreter that runs it, and the ways in which it is tried."""

    name: str
    driver: Path
    python: Path
    ways: tuple[tuple[str, ...], ...] = ((),)


@dataclass(frozen=True)
class Result:
    """Of one tool on one log; `verdict` None where it failed, and `told` says how.

    `processor` [s]; `lines` a user writes, data apart. `names`: by verdict of
    `benchmarks.battery.scoring` how many effects were named, of simulated robots.
    """

    tool: str
    verdict: Verdict | None
    processor: float
    lines: int
    told: str = ""
    names: Mapping[str, int] | None = None


def tools(figaroh: Path | None, sysid: Path | None, case: Case) -> tuple[Tool, ...]:
    """Those that can be run here; where motors are coupled, FIGAROH told so as well."""
    own = Path(sys.executable)
    found = [Tool(WLS, FOLDER / "wls_driver.py", own), Tool(URDF, FOLDER / "urdf_driver.py", own)]
    if sysid is not None:
        found.insert(0, Tool(SYSID, FOLDER / "sysid_driver.py", sysid, _SYSID_WAYS))
    if figaroh is not None:
        driver = FOLDER / "figaroh_driver.py"
        if case.coupled:
            ways = tuple((*way, *case.coupled) for way in _FIGAROH_WAYS)
            found.insert(0, Tool(TOLD, driver, figaroh, ways))
        found.insert(0, Tool(FIGAROH, driver, figaroh, _FIGAROH_WAYS))
    return tuple(found)


def tried(tool: Tool, judge: Judge, folder: Path) -> Result:
    """A driver on what lies in `folder`; of several ways the one with the least error."""
    found = [_tried(tool, way, judge, folder) for way in tool.ways]
    return min(found, key=lambda each: each.verdict.mean if each.verdict else float("inf"))


def _tried(tool: Tool, way: Sequence[str], judge: Judge, folder: Path) -> Result:
    answer = folder / f"{tool.driver.stem}.npz"
    answer.unlink(missing_ok=True)
    run = ran([tool.python, tool.driver, folder, answer, *way], longest=_LONGEST)
    lines = lines_of_user(tool.driver)
    if not answer.is_file():
        return Result(tool.name, None, run.processor, lines, run.last)
    torques, phi, told = read_answer(answer)
    return Result(tool.name, judge.verdict(torques, phi), run.processor, lines, told)


def excite(case: Case, stored: Path) -> tuple[dict[str, Any] | None, Ended]:
    """What `excite diagnose` says, with the diagnosis in the file `stored`."""
    held_out = () if case.held_out is None else ("--held-out", case.held_out)
    files = (case.config, case.data, *held_out, "-o", stored, "--overwrite")
    run = ran([*EXCITE_PROGRAM, "diagnose", *files, "--json", "--no-progress"], longest=_LONGEST)
    return run.answer, run

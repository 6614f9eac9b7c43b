"""Tools on one log, as processes of their own: answers, processor time, lines that a user writes.

Ours is `excite diagnose` of a config that declares no effect; others have drivers.
"""

import json
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.battery.scoring import Truth, answer_of_json, plant_of_record, score
from benchmarks.peers.exchange import lines_of_user, read_answer
from benchmarks.peers.log_judge import Case, Judge, Verdict
from benchmarks.program import EXCITE as EXCITE_PROGRAM
from benchmarks.program import ran
from excite_cli.atomic import write_text_atomically
from excite_cli.store.model_file import consistent_model, read_model

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


def tools(figaroh: Path | None, sysid: Path | None, case: Case) -> list[Tool]:
    """Those that can be run here; where motors are coupled, FIGAROH told so as well."""
    own, found = Path(sys.executable), []
    if figaroh is not None:
        driver = FOLDER / "figaroh_driver.py"
        found.append(Tool(FIGAROH, driver, figaroh, _FIGAROH_WAYS))
        if case.coupled:
            ways = tuple((*way, *case.coupled) for way in _FIGAROH_WAYS)
            found.append(Tool(TOLD, driver, figaroh, ways))
    if sysid is not None:
        found.append(Tool(SYSID, FOLDER / "sysid_driver.py", sysid, _SYSID_WAYS))
    plain = ((WLS, "wls_driver.py"), (URDF, "urdf_driver.py"))
    return found + [Tool(name, FOLDER / driver, own) for name, driver in plain]


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


def diagnosed(case: Case, judge: Judge, folder: Path) -> list[Result]:
    """Ours: the model that it tells its errors of, and the one with bodies that can be."""
    stored = folder / "diagnosis.h5"
    held_out = () if case.held_out is None else ("--held-out", case.held_out)
    files = (case.config, case.data, *held_out, "-o", stored, "--overwrite")
    run = ran([*EXCITE_PROGRAM, "diagnose", *files, "--json", "--no-progress"], longest=_LONGEST)
    config = case.config.read_text(encoding="utf-8").splitlines()
    lines = 1 + sum(bool(each.strip()) and not each.strip().startswith("#") for each in config)
    if run.answer is None:
        return [Result(name, None, run.processor, lines, run.last) for name in (EXCITE, BODIES)]
    found, robot = read_model(stored), judge.case.robot
    names = None if case.is_real else verdicts(run.answer, case, robot.n)
    results = []
    for name, model in ((EXCITE, found.model), (BODIES, consistent_model(found))):
        torques = [model.predicted(robot, part).torque for part in judge.held_out]
        verdict = judge.verdict(torques, model.phi.reshape(-1, 10))
        results.append(Result(name, verdict, run.processor, lines, names=names))
    return results


def verdicts(answer: dict[str, Any], case: Case, joints: int) -> dict[str, int]:
    """How many named effects are true, …, wrong; how many are `planted`, and how many `told`."""
    plants = [plant_of_record(each) for each in case.planted]
    told = replace(answer_of_json(answer), saturated=frozenset())  # by names alone
    scored = score(Truth(plants, joints), told)
    return dict(Counter(scored.names)) | {"planted": len(plants), "told": sum(scored.found)}


@dataclass(frozen=True)
class Entry:
    """All results on one log, the `date` of each tool's by its name."""

    name: str
    words: str
    real: bool
    results: tuple[Result, ...]
    dates: Mapping[str, str]

    def of(self, tool: str) -> Result | None:
        """The result of a tool, None where it never ran."""
        return next((each for each in self.results if each.tool == tool), None)


def merged(old: Entry | None, new: Entry) -> Entry:
    """The new results, and those of the old ones whose tool did not run now."""
    if old is None:
        return new
    now = {each.tool for each in new.results}
    kept = tuple(each for each in old.results if each.tool not in now)
    return replace(new, results=(*new.results, *kept), dates={**old.dates, **new.dates})


def write_entries(path: Path, entries: Sequence[Entry]) -> None:
    """All of them; NaN, of joints that do not move, is null."""
    text = json.dumps([asdict(each) for each in entries], indent=1, ensure_ascii=False)
    write_text_atomically(path, text.replace("NaN", "null") + "\n")


def read_entries(path: Path) -> list[Entry]:
    """What `write_entries` wrote; none if there is no file."""
    if not path.is_file():
        return []
    return [_entry(each) for each in json.loads(path.read_text(encoding="utf-8"))]


def _entry(told: dict[str, Any]) -> Entry:
    for each in told["results"]:
        if (verdict := each["verdict"]) is not None:
            known = {j: float("nan") if x is None else x for j, x in verdict["by_joint"].items()}
            each["verdict"] = Verdict(**{**verdict, "by_joint": known})
    return Entry(**{**told, "results": tuple(Result(**each) for each in told["results"])})

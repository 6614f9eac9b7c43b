"""Whole campaigns on simulated robots, beside the same motion time spent without closing the loop.

    python -m benchmarks.closed_loops [--only WORD …] [--folder FOLDER] [--page docs/campaigns.md]

Five robots, each with inertias 10–30 % off its description and three effects that its config does
not declare. Campaigns begin within a share of the limits, and one effect does not show there: a
torque that saturates. Beside each campaign: as many motions, planned in one go, as its seconds
allow (`plain`), and random ones (`random`), at their own pace, diagnosed once. All models are then
judged on two held-out random motions: the error of their torque where joints move.
Every command is one that a user types. One file per robot, so that a run can be resumed.
"""

import argparse
import json
import os
from dataclasses import dataclass, replace
from datetime import date
from math import ceil
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks import pages
from benchmarks.battery.scoring import Name, same
from benchmarks.program import ROOT, excite
from excite_cli import motions_of, read_diagnosis
from excite_cli.api.loading import load_problem
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import random_baseline
from excite_cli.excitation.result import Result
from excite_cli.store.result_file import read_result, write_result

PART = pages.MarkedPart("campaigns", "benchmarks.closed_loops")
_TEST_SEED = 4711
_TEST_MOTIONS = 2
_FIRST = 3  # motions that are planned at least
_DRAWN = 4  # random motions per one that is played

Record = dict[str, Any]


@dataclass(frozen=True)
class Loop:
    """A robot: what `init` is given (or its config), and effects as `--effect` takes them.

    One more is put in: the torque of a joint saturates at a level that the motions pass at full
    pace and not in the first round (`late_effect`).
    """

    name: str
    config: tuple[str, ...]
    effects: tuple[str, ...]
    from_speed: float = 0.4
    more: tuple[str, ...] = ()
    by_motions: bool = False  # as many motions beside it, not seconds: they take minutes to plan


_ARMS = [f"arm_{side}_{k}_joint" for side in ("left", "right") for k in range(1, 8)]
LOOPS = (
    Loop("UR10", ("--robot", "ur10"),
         ("load_dependent_friction@elbow_joint=0.06", "spring@wrist_1_joint=4")),
    Loop("Panda", ("--robot", "panda"),
         ("ripple@panda_joint2=1.5,periods:20", "torque_offset@panda_joint4=0.8")),
    Loop("TALOS' arms", ("--robot", "talos", "--joints", ",".join(_ARMS)),
         ("coulomb_friction@arm_left_4_joint=1.5", "spring@arm_right_2_joint=4")),
    Loop("bench arm (MJCF)", ("--urdf", str(ROOT / "data/bench_arm.xml")),
         ("stribeck_friction@shoulder=4", "spring@pitch=2")),
    Loop("standing TALOS", ("configs/talos_base.yaml",),
         ("base_tilt@all=0.01,pitch:0.0524", "coulomb_friction@arm_left_1_joint=2"),
         more=("--set", "robot.rows=[base, joints]"), by_motions=True),
)  # fmt: skip


class Folder:
    """Runs `excite` in the folder of one robot."""

    def __init__(self, place: Path) -> None:
        self.place = place
        place.mkdir(parents=True, exist_ok=True)

    def excite(self, *words: str, good: tuple[int, ...] = (0,)) -> Any:
        """What `--json` answers."""
        return excite(*words, "--json", folder=self.place, good=good).answer or {}


def closed(loop: Loop, folder: Folder) -> Record:
    """The campaign, and what the same seconds give otherwise."""
    config = _config(loop, folder)
    settings = ("--seed", "1", *loop.more)
    problem = load_problem(folder.place / config, ["seed=1", *loop.more[1::2]])
    plain = ("optimize", config, *settings, "-o", "plain.h5")
    if not (folder.place / "plain.h5").exists():
        folder.excite(*plain, "--motions", str(_FIRST))
    first = ("--set", f"constraints.joint_limits.pace={loop.from_speed}", "-o", "slow.h5")
    if not (folder.place / "slow.h5").exists():
        folder.excite(*plain[:-2], *first, "--motions", str(_FIRST))
    plans = (folder.place / f"{name}.h5" for name in ("slow", "plain"))
    effects = (*loop.effects, late_effect(problem, *plans))
    robot = tuple(word for text in effects for word in ("--effect", text))
    measured = ("--measure", "simulate", "--from-speed", str(loop.from_speed), *robot)
    resume = ("--resume",) if (folder.place / "campaign" / "campaign.json").exists() else ()
    whole = folder.excite("campaign", config, *measured, *settings, *resume, good=(0, 1))
    wanted = ceil(whole["seconds"] / problem.trajectory.duration - 1e-6)
    count = max(_FIRST, whole["motions"] if loop.by_motions else wanted)
    folder.excite(*plain, "--motions", str(count), "--resume")
    like = folder.place / "plain.h5"
    _random(problem, like, folder.place / "random.h5", count, seed=1)
    _random(problem, like, folder.place / "test.h5", _TEST_MOTIONS, _TEST_SEED)
    play = (*robot, *settings, "--overwrite")
    folder.excite("simulate", config, "test.h5", "-o", "test_log.h5", *play)
    ways: Record = {}
    last = whole["rounds"][-1]["number"]
    found = {"campaign": f"campaign/round_{last}_diagnosis.h5"}
    for way in ("plain", "random"):
        folder.excite("simulate", config, f"{way}.h5", "-o", f"{way}_log.h5", *play)
        found[way] = f"{way}_diagnosis.h5"
        output = ("-o", found[way], "--overwrite")
        folder.excite("diagnose", config, f"{way}_log.h5", *loop.more, *output, good=(0, 1))
    declared = {each.kind for each in read_diagnosis(folder.place / found["plain"]).declared}
    for way, file in found.items():
        scored = folder.excite("score", file, "test_log.h5", good=(0, 1))
        ways[way] = {"named": _named(folder.place / file), "missed": _missed(scored)}
    ways["campaign"] |= {"seconds": whole["seconds"], "motions": whole["motions"]}
    for way in ("plain", "random"):
        ways[way] |= {"seconds": count * problem.trajectory.duration, "motions": count}
    return {
        "robot": loop.name,
        "joints": problem.robot.n,
        # Dry friction is declared for TALOS: what is put in of it is no secret.
        "planted": [text for text in effects if text.split("@")[0] not in declared],
        "rounds": whole["rounds"],
        "ended": whole["ended"],
        "reason": whole["reason"],
        "ways": ways,
    }


def late_effect(problem: Problem, slow: Path, own: Path) -> str:
    """Saturation of a joint between its largest torques in motions of a first round and at full.

    Of the joint where these differ most, by the description's inertias.
    """
    dynamics, times = InverseDynamics(problem.robot), problem.constraint_basis.times
    below, above = (
        np.max(
            [
                np.abs(dynamics.torques(q, v, a)).max(axis=0)
                for each in motions_of(read_result(plan))
                for q, v, a in [each.trajectory.states(times, each.coefficients)]
            ],
            axis=0,
        )
        for plan in (slow, own)
    )
    names = problem.robot.joint_names
    rows = [j for j in range(len(names)) if above[j] > 1.0]
    joint = max(rows, key=lambda j: above[j] / below[j])
    return f"torque_saturation@{names[joint]}={float(np.sqrt(below[joint] * above[joint])):.3g}"


def planted(record: Record) -> list[Name]:
    """Names of all effects that are in the robot."""
    parts = (text.split("=")[0].split("@") for text in record["planted"])
    return [Name(kind, tuple(joints.split(","))) for kind, joints in parts]


def _config(loop: Loop, folder: Folder) -> str:
    """The config in the folder, as `init` makes it where there is none."""
    if len(loop.config) > 1:
        folder.excite("init", *loop.config, "-o", "robot.yaml", "--overwrite")
        return "robot.yaml"
    text = (ROOT / loop.config[0]).read_text(encoding="utf-8")
    (folder.place / "robot.yaml").write_text(text.replace("../data", str(ROOT / "data")))
    return "robot.yaml"


def _random(problem: Problem, like: Path, path: Path, count: int, seed: int) -> None:
    """Random admissible motions, the best few of many, as a result file."""
    found = random_baseline(problem, count, seed, _DRAWN * count, 0.0, lambda drawn, best: None)
    model: Result = read_result(like)
    motions = [
        _as_motion(model, index, each.coefficients)
        for index, each in enumerate(found.motions, start=1)
    ]
    write_result(path, replace(model, motions=tuple(motions)), problem)


def _as_motion(model: Result, index: int, coefficients: Any) -> Any:
    return replace(model.motions[0], index=index, coefficients=coefficients)


def _named(file: Path) -> list[list[Any]]:
    found = read_diagnosis(file)
    return [
        [[each.effect.kind, list(each.effect.joints)]]
        + [[alias.kind, list(alias.joints)] for alias in each.aliases]
        for each in found.named
    ]


def _missed(scored: Record) -> float:
    shares = [share for run in scored["runs"] for share in run["relative_moving"].values()]
    return float(np.nanmean(np.array(shares, dtype=float)))


def right(record: Record, named: list[list[Any]]) -> tuple[int, int]:
    """How many of the planted effects are named, and how many names are of none of them."""
    sets = [[Name(kind, tuple(where)) for kind, where in each] for each in named]
    there, joints = planted(record), record["joints"]
    found = sum(any(same(plant, names[0], joints) for names in sets) for plant in there)
    wrong = sum(not any(same(p, n, joints) for p in there for n in names) for names in sets)
    return found, wrong


def table(records: list[Record]) -> str:
    """Markdown: a row per robot and way."""
    rows = []
    for record in records:
        for way, each in record["ways"].items():
            found, wrong = right(record, each["named"])
            named = f"{found} of {len(record['planted'])}"
            spent = (each["motions"], f"{each['seconds']:.0f}")
            rows.append([record["robot"], way, *spent, named, wrong, f"{each['missed']:.2%}"])
    heads = ("robot", "way", "motions:", "seconds:", "effects named", "wrong names:")
    return pages.table([*heads, "held-out error:"], rows)


def rounds(records: list[Record]) -> str:
    """Markdown: a row per round."""
    rows: list[list[object]] = []
    for record in records:
        for each in record["rounds"]:
            learned = each["learned"]
            seconds = sum(motion["seconds"] for motion in each["motions"])
            pace = min(motion["pace"] for motion in each["motions"])
            errors = (f"{learned[when]:.2%}" for when in ("before", "after"))
            told = (each["number"], f"{pace:.0%}", f"{seconds:.0f}", *errors)
            rows.append([record["robot"], *told, ", ".join(learned["effects"])])
        rows.append([record["robot"], "ended", "", "", "", "", record["reason"]])
    heads = ("robot", "round:", "pace:", "seconds:", "error before:", "error after:")
    return pages.table([*heads, "effects found"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", help="robots whose name has one of these words")
    parser.add_argument("--folder", type=Path, default=Path("results/closed_loops"))
    parser.add_argument("--page", type=Path, help="put the figures between its marks")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    records = []
    for loop in LOOPS:
        path = options.folder / f"{loop.name.replace(' ', '_')}.json"
        wanted = not options.only or any(word in loop.name for word in options.only)
        if wanted and not path.exists():
            place = Folder((options.folder / path.stem).resolve())
            path.write_text(json.dumps(closed(loop, place), indent=1))
        if path.exists():
            records.append(json.loads(path.read_text()))
            print(table(records[-1:]), flush=True)
    if options.page is not None:
        parts = (f"{date.today():%d %B %Y}.", table(records), "## Rounds", rounds(records))
        PART.write(options.page, "\n\n".join(parts))


if __name__ == "__main__":
    main()

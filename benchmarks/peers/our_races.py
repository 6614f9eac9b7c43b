"""This program as a contestant: how it is asked and read."""

import sys
from typing import Any

import numpy as np

from benchmarks.peers.figaroh_races import run_driver
from benchmarks.peers.judge import Judge, motion_states
from benchmarks.peers.race import Race
from excite_cli.constraints.base import Array

OURS = "excite"
OWN = "excite, own columns"
# Gradient, self-collision, and whether FIGAROH's columns are taken for the cost.
CONTESTANTS = {
    OURS: ("exact", True, True),
    OWN: ("exact", True, False),
    "excite, finite differences": ("differences", True, True),
    "excite, self-collision off": ("exact", False, True),
}
BLIND = "constraints.self_collision=null"


def race(judge: Judge, name: str, seed: int, columns: tuple[int, ...] | None) -> Race:
    """One motion of the judge's config; its curve has what the judge admits at 1 kHz only."""
    gradient, self_collision, by_peer = CONTESTANTS[name]
    request = {
        "config": str(judge.config),
        "overrides": [] if self_collision else [BLIND],
        "seed": seed,
        "gradient": gradient,
        "columns": columns if by_peer else None,
    }
    answer = run_driver([sys.executable, "-m", "benchmarks.peers.our_driver"], request)
    final = answer.get("final")
    curve = admitted(judge, answer, self_collision, columns)
    return Race(
        contestant=name,
        seed=seed,
        curve=curve,
        wall=float(answer["wall"]),
        processor=float(answer["processor"]),
        before=float(answer["processor_before"]),
        fine=None if final is None else motion_states(judge.problem, final, judge.fine),
        samples=None if final is None else motion_states(judge.problem, final, judge.cost),
        columns=columns,
        proved=bool(answer["proved"]),
        words={"evaluations": len(answer["notes"]), "says": str(answer["status"])},
    )


def admitted(
    judge: Judge, answer: dict[str, Any], self_collision: bool, columns: tuple[int, ...] | None
) -> Array:
    """Notes that improve in either measure and keep every constraint of the config at 1 kHz."""
    kept: list[Array] = []
    lowest = np.full(2, np.inf)
    for spent, coefficients in zip(answer["notes"], answer["coefficients"], strict=True):
        samples = motion_states(judge.problem, coefficients, judge.cost)
        values = np.array([judge.condition_number(samples, of) for of in (columns, None)])
        if (values < lowest).any() and judge.keeps_config(coefficients, self_collision):
            kept.append(np.concatenate([spent[:2], values]))
            lowest = np.minimum(lowest, values)
    return np.array(kept).reshape(-1, 4)

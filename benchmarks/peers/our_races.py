"""This program as a contestant: how it is asked and read."""

import sys
from typing import Any

import numpy as np

from benchmarks.peers.figaroh_races import run_driver
from benchmarks.peers.judge import Judge, motion_states
from benchmarks.peers.race import Race
from excite_cli.constraints.base import Array

NAMES = {
    ("exact", True): "excite",
    ("differences", True): "excite, finite differences",
    ("exact", False): "excite, self-collision off",
}
BLIND = "constraints.self_collision=null"


def race(
    judge: Judge, seed: int, gradient: str, self_collision: bool, columns: tuple[int, ...] | None
) -> Race:
    """One motion of the judge's config; its curve has what the judge admits at 1 kHz only."""
    request = {
        "config": str(judge.config),
        "overrides": [] if self_collision else [BLIND],
        "seed": seed,
        "gradient": gradient,
        "columns": columns,
    }
    answer = run_driver([sys.executable, "-m", "benchmarks.peers.our_driver"], request)
    final = answer.get("final")
    curve = admitted(judge, answer, self_collision)
    return Race(
        contestant=NAMES[gradient, self_collision],
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


def admitted(judge: Judge, answer: dict[str, Any], self_collision: bool) -> Array:
    """Improving notes that keep every constraint of the config at 1 kHz, and the final motion."""
    kept: list[Array] = []
    lowest = np.inf
    for note, coefficients in zip(answer["notes"], answer["coefficients"], strict=True):
        if note[2] < lowest and judge.keeps_config(coefficients, self_collision):
            kept.append(note)
            lowest = note[2]
    return np.array(kept).reshape(-1, 3)

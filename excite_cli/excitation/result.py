"""The record of a whole run: what was asked, what was found, and on what."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.excitation.motion import Doubt, Motion, digest_of
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomBaseline, RandomMotion
from excite_cli.excitation.sequence import FinishedMotion
from excite_cli.shown.answer import Shown, offered


@dataclass(frozen=True, repr=False)
class Result(Shown):
    """Motions of one problem so far, with the stack that includes them and the priors.

    `config` is the full resolved problem as YAML text, `config_folder` where its relative paths
    start, `fingerprint` the robot's. `prior_stack` holds what was there before motion 1.
    `base_words` and `column_scales` go on with the columns of effects, where there are any.
    """

    config: str
    config_folder: str
    fingerprint: str
    seed: int
    joint_names: tuple[str, ...]
    base_selection: Indices
    base_words: tuple[str, ...]
    row_weights: Array
    column_scales: Array
    motions: tuple[Motion, ...]
    stack: Stack
    prior_stack: Stack
    random: tuple[RandomMotion, ...] = ()
    random_candidates: tuple[int, int] = (0, 0)
    priors: tuple[str, ...] = ()
    versions: dict[str, str] = field(default_factory=dict)
    checked_pairs: tuple[str, ...] = ()
    dropped_pairs: tuple[str, ...] = ()

    def plot(self, motion: int | None = None, joint: str | None = None, ax: Any = None) -> Any:
        """Position, speed, acceleration in time [rad, m, s] of a motion, by default the last.

        A row per joint; in `ax` (matplotlib) one joint's position. Axes are returned.

        Raises
        ------
        ConfigError, RobotError, MissingExtraError
            There is no such motion or joint; the URDF is gone; matplotlib is not installed.
        """
        return offered(self)["plot"](self, motion, joint, ax)

    @property
    def effect_names(self) -> tuple[str, ...]:
        """Names of the columns beside those of base parameters."""
        return self.base_words[len(self.base_selection) :]

    def with_step(self, step: FinishedMotion) -> "Result":
        """The result with one more motion, and the digest of what is said of it here."""
        motion = replace(step.motion, digest=self.digest_of(step.motion))
        return replace(self, motions=(*self.motions, motion), stack=step.stack)

    def digest_of(self, motion: Motion) -> str:
        """The digest of a motion of this result, of what is said of it and of what it was for."""
        return digest_of(motion, self.config, self.fingerprint, self.joint_names)

    def doubted(self) -> tuple[Motion, ...]:
        """Those of the motions that do not count as proved, also for a change since they were read.

        One that was made elsewhere and has no digest says nothing against itself.
        """
        found = []
        for motion in self.motions:
            if motion.doubt:
                found.append(motion)
            elif motion.digest and motion.digest != self.digest_of(motion):
                found.append(motion.doubted(Doubt.CHANGED))
        return tuple(found)

    def with_config(self, config: str) -> "Result":
        """The result for another config that asks for the same; digests of before go on to hold."""
        new = replace(self, config=config)
        motions = (
            replace(m, digest=new.digest_of(m)) if m.digest == self.digest_of(m) else m
            for m in self.motions
        )
        return replace(new, motions=tuple(motions))


def matches(problem: Problem, result: Result) -> str | None:
    """None when stacks of `result` fit `problem`; otherwise what differs, in words."""
    if result.fingerprint != problem.robot.fingerprint():
        return "it was made for another robot, other moved joints, posture or rows"
    if result.joint_names != problem.robot.joint_names:
        return "it names other joints, or in another order"
    if not np.array_equal(result.base_selection, problem.base.selection):
        return "its base parameters differ"
    here = problem.extension.names
    if result.effect_names != here:
        return (
            f"its regressor has other effects ({_listed(result.effect_names)}; here "
            f"{_listed(here)}), see `effects` in the config"
        )
    same_rows = _same(result.row_weights, problem.weighting.rows)
    same_columns = _same(result.column_scales, problem.column_scales)
    if not (same_rows and same_columns):
        return "its row weights or column scaling differ"
    return None


def _same(first: Array, second: Array) -> bool:
    return first.shape == second.shape and np.allclose(first, second, rtol=1e-12, atol=0.0)


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """The `result` with the random motions in it, and how these were drawn."""

    result: Result
    baseline: RandomBaseline

    @property
    def seconds(self) -> float:
        """What the optimiser took [s]."""
        return sum(motion.seconds for motion in self.result.motions)

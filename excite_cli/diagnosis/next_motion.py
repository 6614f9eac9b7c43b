"""The next motion after a diagnosis: separate what the data could not, else excite what is known.

Both problems take what the diagnosis measured: the data's factor as C_0, rows weighted by 1/noise
(each sample of the cost grid counts as an independent one), and the effects that were found.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import qr

from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.spec import CriterionSpec, Spec
from excite_cli.criteria.catalogue import build_criterion
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.diagnosis.separation import DataColumns, separated
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.uncertain_inertias import FitKnowledge
from excite_cli.errors import FileError
from excite_cli.excitation.discrimination import SEPARATED, divergences, motions_needed
from excite_cli.excitation.effect_columns import in_words, why_not_planned
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, build_problem, predicting
from excite_cli.robot.base_joints import BASE_ROWS
from excite_cli.robot.model import Array, Robot, build_measured_robot
from excite_cli.shown.answer import Command, Shown, as_word


@dataclass(frozen=True, repr=False)
class NextMotion(Shown):
    """The problem of the next motion, and the `model` that its result is kept for.

    `prior` are the measured data on the columns of `model`, which is `problem` unless that
    separates effects; then `problem` has the rivals' columns too. `purpose` is `separate` or
    `excite`; `messages` say what is done and why; `name` is the file of the diagnosis, if it was
    read from one. `known`: the problem in which torques are predicted, with the data on its
    columns; None where the data are those of a base as well.
    """

    problem: Problem
    model: Problem
    prior: Stack
    purpose: str
    messages: tuple[str, ...]
    known: tuple[Problem, Stack] | None = None
    name: str = "the diagnosis"

    @property
    def spec(self) -> Spec:
        """The resolved problem that the result is kept for."""
        return self.model.spec

    @property
    def restarts(self) -> int:
        """Starts of the next motion."""
        return self.problem.restarts

    def outlook(self, coefficients: Sequence[Array]) -> dict[str, Any]:
        """What the motions (coefficients (K, n) each) are expected to show, for `--json`.

        For every pair the divergence (½ Δ, the smaller of both ways) before and after, and how
        many motions like the first reach `SEPARATED`, all told; None: more than a thousand.
        """
        found: dict[str, Any] = {"purpose": self.purpose, "pairs": []}
        separation = self.problem.separation
        if separation is None or not coefficients:
            return found
        objective = self.problem.objective(separation.prior)
        blocks = [objective.block(alpha) for alpha in coefficients]
        grams = [block.T @ block for block in blocks]
        before = separation.prior.factor.T @ separation.prior.factor
        after = before + np.sum(grams, axis=0)
        ways = separation.directions
        for both in zip(ways[::2], ways[1::2], strict=True):
            found["pairs"].append(
                {
                    "effect": both[0].pair[0],
                    "alias": both[0].pair[1],
                    "kl_so_far": float(divergences(before, both).min()),
                    "expected_kl": float(divergences(after, both).min()),
                    "motions_needed": motions_needed(before, grams[0], both),
                }
            )
        found["expected_kl"] = min(pair["expected_kl"] for pair in found["pairs"])
        found["distinguished_from"] = SEPARATED
        return found


def next_experiment(
    diagnosis: Diagnosis, config: str = "CONFIG", file: str = "DIAGNOSIS.h5"
) -> dict[str, Any]:
    """What to do next, without planning it: purpose, the pairs to tell apart, the command."""
    pairs = [
        {"effect": _as_data(named), "alias": _as_data(alias)}
        for named, alias in _alias_pairs(diagnosis)
    ]
    purpose = "separate" if pairs else "excite"
    return {"purpose": purpose, "pairs": pairs, "command": next_command(config, file).line}


def next_command(config: str, file: str) -> Command:
    """What plans the next motion of `config` after the diagnosis in `file`."""
    return Command(("excite", "optimize", as_word(config), "--after", as_word(file)))


def plan_after(
    diagnosis: Diagnosis,
    spec: Spec,
    folder: Path,
    fit: FitKnowledge | None = None,
    work: tuple[Array, Array, Array] | None = None,
) -> NextMotion:
    """The problem of `spec` after what `diagnosis` learned.

    fit: of `uncertainty.fit`; work: states q, v, a (N, n) of the log or plan that `task` names.

    Raises
    ------
    FileError
        The diagnosis belongs to another robot, or its numbers do not fit together.
    """
    robot = build_measured_robot(spec.robot, folder)
    asked, spec = spec.criterion, _weighted(diagnosis, spec, robot)
    if robot.base_joints:
        return _on_a_base(diagnosis, build_problem(spec, folder, fit, work, possible=()))
    planned, said = [], _reweighted(asked)
    for record in diagnosis.information.model:
        effect = effect_of(record, robot.joint_names)
        if why := why_not_planned(effect, robot):
            said.append(f"left out of the next motion: {in_words(effect, robot)}: {why}")
        else:
            shape = dict(effect.shape)
            planned.append(EffectSpec(kind=effect.kind, joints=record.joints, shape=shape))
    columns = DataColumns(diagnosis, robot, find_base_parameters(robot).rank)
    of_work = build_criterion(spec.criterion).of_work
    spec = spec.model_copy(update={"effects": tuple(planned)})
    pairs, wide, plain = _alias_pairs(diagnosis), None, spec
    if of_work:  # effects that are only possible are no part of a model that is taken apart
        criterion = spec.criterion.model_copy(update={"kind": "condition_number"})
        plain = spec.model_copy(update={"criterion": criterion})
    if pairs or not of_work:
        problem = build_problem(plain, folder, fit, work)
        prior = columns.factor(problem)
        wide, reasons = separated(problem, columns, pairs)
        said += reasons
    if wide is None and of_work:
        problem = build_problem(spec, folder, fit, work, columns.possible)
        prior = columns.factor(problem)
    predicted = predicting(problem, possible=columns.possible)
    known = predicted, columns.factor(predicted)
    if wide is not None:
        assert wide.separation is not None
        names = [" / ".join(d.pair) for d in wide.separation.directions[::2]]
        said.insert(
            0, f"the next motion separates these indistinguishable effects: {'; '.join(names)}"
        )
        return NextMotion(wide, problem, prior, "separate", tuple(said), known)
    why = "all effects are distinguishable" if not pairs else "no motion distinguishes the effects"
    count, more = len(planned), len(problem.extension.effects) - len(planned)
    beside = f" with its {count} effect{'s' if count > 1 else ''}" if count else ""
    beside += f" and {more} that it may have" if more > 0 else ""
    said.insert(0, f"{why}: the next motion excites the model{beside}, on top of the measured data")
    return NextMotion(problem, problem, prior, "excite", tuple(said), known)


def _reweighted(asked: CriterionSpec) -> list[str]:
    """What is not as the config's criterion asks for it."""
    said = []
    if asked.row_weights != "none":
        said.append(
            "criterion.row_weights is not used: measured data count in units of their own noise"
        )
    if not build_criterion(asked).of_work:
        said.append(
            "condition numbers are those of rows in units of the measured noise and of columns of "
            "length 1, effects among them: not comparable with those of motions planned before"
        )
    return said


def _weighted(diagnosis: Diagnosis, spec: Spec, robot: Robot) -> Spec:
    """The problem without effects, its rows weighted by 1/noise."""
    if diagnosis.fingerprint != robot.fingerprint():
        raise FileError(
            "--after: the diagnosis was made for another robot, other moved joints, posture or "
            "rows. Give the config that it was made with."
        )
    names = diagnosis.joint_names
    rows = [*BASE_ROWS, *names[len(BASE_ROWS) :]] if robot.base_joints else names
    known = [name not in robot.unmeasured for name in names]
    noise = np.asarray(diagnosis.information.noise, dtype=float)
    if not (np.all(np.isfinite(noise[known])) and np.all(noise[known] > 0)):
        raise FileError("--after: the diagnosis has no noise level for every joint; make it anew.")
    told = zip(rows, noise, known, strict=True)
    weights = {row: float(1.0 / level) for row, level, measured in told if measured}
    weighting: dict[str, Any] = {"row_weights": weights}
    if spec.criterion.column_scaling == "none":
        # Rows in units of their noise differ by powers of ten; columns must not.
        weighting["column_scaling"] = "unit_norm"
    criterion = spec.criterion.model_copy(update=weighting)
    return spec.model_copy(update={"effects": (), "criterion": criterion})


def _on_a_base(diagnosis: Diagnosis, problem: Problem) -> NextMotion:
    """The inertias alone, of data with a wrench at the base: effects are not planned there."""
    triangle, rank = np.asarray(diagnosis.information.factor, dtype=float), problem.base.rank
    others = triangle.shape[1] - rank
    # What the effects take up of the data is not known of the inertias: their columns come first.
    turned = np.asarray(qr(np.hstack([triangle[:, rank:], triangle[:, :rank]]), mode="r")[0])
    rows = turned[others : others + rank, others:] * problem.column_scales
    prior = Stack(np.ascontiguousarray(rows), len(rows))
    said = ["the next motion excites the inertias, on top of the measured data"]
    if diagnosis.effects:
        said.append(
            f"{len(diagnosis.effects)} effects that were found are separated from the inertias, "
            "and not planned for: no column of a motion has their share of the wrench at the base"
        )
    return NextMotion(problem, problem, prior, "excite", tuple(said))


def _alias_pairs(diagnosis: Diagnosis) -> list[tuple[EffectRecord, EffectRecord]]:
    """Named effects and what stands for them, but for what takes a scale and no motion to tell."""
    return [
        (named.effect, alias)
        for named in diagnosis.effects
        if named.verdict is not HeldOutVerdict.WEIGHED
        for alias in named.aliases
    ]


def _as_data(record: EffectRecord) -> dict[str, Any]:
    found = {"kind": record.kind, "joints": list(record.joints), "shape": dict(record.shape)}
    return found | ({"covariate": record.covariate} if record.covariate else {})

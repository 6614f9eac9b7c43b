"""Diagnoses made up from a planned motion on a known model, without any data."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import qr

from excite_cli.config.load_spec import load_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import (
    ConfoundedCandidate,
    Diagnosis,
    EffectRecord,
    ErrorReduction,
    ExcessResidual,
    Information,
    NamedEffect,
    Round,
    Suspect,
)
from excite_cli.diagnosis.traces import Dependence, EffectTrace, Traces
from excite_cli.diagnosis.verdict import HeldOutVerdict, Verdict
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.effects.base import Value
from excite_cli.excitation.effect_columns import EffectColumns
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.torque_trace import TorqueTrace, single
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Array

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
FAST = ("constraints.self_collision=null", "constraints.torque=null", "sequence.motions=1")
NOISE = 0.5


def viscous(joint: str = "elbow", value: float = 2.0) -> EffectRecord:
    return EffectRecord("viscous_friction", (joint,), {}, (value,))


def quadratic(joint: str = "elbow", value: float = 5.0) -> EffectRecord:
    return EffectRecord("nonlinear_viscous_friction", (joint,), {"power": 2.0}, (value,))


def smoke_spec(*changes: str) -> Spec:
    return load_spec(CONFIG, [*FAST, *changes])


@dataclass(frozen=True)
class Earlier:
    """Rows of the earlier data, [base, model, rivals], not yet divided by the noise."""

    problem: Problem
    rows: Array


def earlier_data(model: Sequence[EffectRecord], rivals: Sequence[EffectRecord]) -> Earlier:
    """A slow motion of small amplitude: all speeds are small and much alike."""
    problem = build_problem(smoke_spec(), CONFIG.parent)
    robot = problem.robot
    rng = np.random.default_rng(5)
    times = np.linspace(0.0, 60.0, 600)
    phase = rng.uniform(0, 6, (3, robot.n))
    rate = 0.3 + 0.5 * rng.random((3, robot.n))
    waves = rate * times[:, None, None] + phase
    q = problem.robot.posture + 0.1 * np.sin(waves).sum(1)
    v = 0.1 * (rate * np.cos(waves)).sum(1)
    a = -0.1 * (rate**2 * np.sin(waves)).sum(1)
    y = Regressor(robot).evaluate(q, v, a)[:, :, problem.base.selection]
    effects = [effect_of(record, robot.joint_names) for record in (*model, *rivals)]
    beside = EffectColumns(robot, effects, 1e-3).evaluate(times, q, v, a).columns
    return Earlier(problem, np.concatenate([y, beside], axis=2).reshape(600 * robot.n, -1))


def make_diagnosis(
    model: Sequence[EffectRecord] = (viscous(),),
    rivals: Sequence[EffectRecord] = (quadratic(),),
    noise: float = NOISE,
) -> Diagnosis:
    """The first effect of `model` is named with all `rivals` as its aliases."""
    earlier = earlier_data(model, rivals)
    robot = earlier.problem.robot
    factor = qr(earlier.rows / noise, mode="r")[0][: earlier.rows.shape[1]]
    names = robot.joint_names
    errors = Errors(
        0.1, 0.12, dict.fromkeys(names, 0.1), dict.fromkeys(names, float("nan")),
        dict.fromkeys(names, 1.0), dict.fromkeys(names, 2.0), (0.08, 0.12),
    )  # fmt: skip
    suspect = Suspect(model[0], 1e-9, 0.4, 0.2, Verdict.ACCEPTED)
    return Diagnosis(
        config=spec_as_yaml(earlier.problem.spec),
        config_folder=str(CONFIG.parent),
        fingerprint=robot.fingerprint(),
        joint_names=names,
        base_names=earlier.problem.base.in_words(),
        declared=(),
        effects=(
            NamedEffect(
                model[0],
                {"viscous": Value(2.0, 0.1, "N·m·s/rad")},
                1e-9,
                0.4,
                0.2,
                tuple(rivals),
                verdict=HeldOutVerdict.CONFIRMED,
                removes={
                    "elbow": ErrorReduction(0.05, 0.06, 1.5),
                    names[0]: ErrorReduction(-0.01, -0.01, -0.1),
                },
            ),
        ),
        absorbed=(ConfoundedCandidate("armature", (names[0],), ("Izz[shoulder_yaw]",), 1e-5),),
        held_out_run="run_3",
        before=replace(errors, mean_relative=0.2),
        after=errors,
        rounds=(Round(1, dict.fromkeys(names, 1.0), (suspect,), "viscous friction named"),),
        findings=(Finding("jitter", "note", "time stamps jitter by 3 %", "run_1", ("elbow",)),),
        processing={"rate": 40.0, "reasons": ["because"]},
        phi=standard_parameters(robot),
        base_values=earlier.problem.base.mapping @ standard_parameters(robot),
        base_std=np.full(earlier.problem.base.rank, 0.1),
        information=Information(
            factor=np.ascontiguousarray(factor),
            rank=int(np.linalg.matrix_rank(factor)),
            model=tuple(model),
            rivals=tuple(rivals),
            noise=np.full(robot.n, noise),
        ),
        versions={"excite-cli": "0"},
        seconds=1.5,
        excess_residuals=(
            ExcessResidual(
                "elbow", 0.8, 0.04, 0.1, "band", True, 0.6,
                (Covariate("position", "elbow"), Covariate("load", "elbow")),
            ),
        ),
    )  # fmt: skip


def make_traces(
    joints: Sequence[str], samples: int = 240
) -> tuple[Traces, tuple[TorqueTrace, ...]]:
    """Training and held-out traces: viscous friction of 2 N·m·s/rad on the elbow, found."""
    n, elbow = len(joints), list(joints).index("elbow")
    noise = np.random.default_rng(3).normal(size=(samples, n))

    def trace(run: str, held_out: bool) -> TorqueTrace:
        t = np.linspace(0.0, 6.0, samples)
        q = np.sin(t[:, None] + np.arange(n))
        v, load = np.cos(t[:, None] + np.arange(n)), 10.0 * q
        friction = np.zeros_like(q)
        friction[:, elbow] = 2.0 * v[:, elbow]
        measured = load + friction + 0.05 * noise
        measured[:5] = np.nan
        arrays = [single(x) for x in (t, q, v, -q, load, measured)]
        return TorqueTrace(
            run, held_out, *arrays, np.abs(v) > 0.1, single(load + friction), single(load)
        )

    first, second, held_out = trace("run_1", False), trace("run_2", False), trace("run_3", True)
    counted = first.counted[:, [elbow]] & np.isfinite(first.measured[:, [elbow]])
    x, own = first.v[:, [elbow]], 2.0 * first.v[:, [elbow]]
    partial = first.measured[:, [elbow]] - first.load[:, [elbow]]
    effect = EffectTrace(
        "viscous_friction", ("elbow",), (), ("elbow",), "speed", "rad/s", None,
        np.zeros(samples), first.t,
        *(single(np.where(counted, y, np.nan)) for y in (x, own, partial)),
    )  # fmt: skip
    shares = np.zeros((n, 3))
    shares[elbow] = 0.3, 0.0, 0.02
    covariates = (
        Covariate("position", "elbow"),
        Covariate("time"),
        Covariate("position", history=True, own=True),
    )
    dependence = Dependence(tuple(joints), covariates, shares)
    units = ("N·m",) * n
    return Traces(units, (first, second), (effect,), dependence), (held_out,)

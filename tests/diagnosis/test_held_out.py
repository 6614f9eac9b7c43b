"""Nothing of the held-out part is used but for the errors: changed, it changes nothing else."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Assumption, Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import assumption_in_words
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot, build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.trajectory.fourier import FourierTrajectory

SECONDS, RATE = 5.0, 200.0
# What may differ: what is measured on the held-out part, and the time it took.
FREE = {"before", "after", "textbook", "untouched", "held_out_traces", "seconds"}


@pytest.fixture(scope="module")
def spec() -> Spec:
    # A few kinds only: every part of the program is gone through, quickly.
    kinds = "[viscous_friction,coulomb_friction,payload,armature]"
    return load_spec(SMOKE, [f"diagnosis.kinds={kinds}"])


@pytest.fixture(scope="module")
def robot(spec: Spec) -> Robot:
    return build_robot(spec.robot, SMOKE.parent)


@pytest.fixture(scope="module")
def base(robot: Robot) -> BaseParameters:
    return find_base_parameters(robot)


def motion(robot: Robot, number: int) -> PlannedMotion:
    rng = np.random.default_rng(number)
    trajectory = FourierTrajectory(4, 2 * np.pi / SECONDS)
    lower, upper = robot.limits.ranges()
    size = 0.04 * (upper - lower)
    coefficients = rng.normal(size=(trajectory.n_coefficients, robot.n)) * size
    coefficients[-1] = (lower + upper) / 2
    return PlannedMotion(f"motion_{number}", trajectory, coefficients)


@pytest.fixture(scope="module")
def dataset(robot: Robot) -> Dataset:
    """Three runs of an arm with dry friction and, in the last two, a payload."""
    motions = [motion(robot, number) for number in (1, 2, 3)]
    payload = plant(kind_named("payload"), tuple(range(robot.n)), 0.5, {})
    payload = replace(
        payload, effect=replace(payload.effect, runs=("motion_2", "motion_3"))
    )  # fmt: skip
    settings = SimulationSettings(rate=RATE, lead_in=0.5)
    return simulate(robot, motions, settings, [friction(), payload]).dataset


def friction() -> Planted:
    """Of the elbow."""
    return plant(kind_named("coulomb_friction"), (2,), 1.5, {})


def differences(one: Diagnosis, other: Diagnosis) -> list[str]:
    """Fields that are not the same, bit by bit; what is measured on held-out data is left out."""
    one, other = unjudged(one), unjudged(other)
    return [
        field.name
        for field in fields(Diagnosis)
        if not same(getattr(one, field.name), getattr(other, field.name))
    ]


def unjudged(found: Diagnosis) -> Diagnosis:
    effects = tuple(replace(each, verdict=None, removes={}, parts={}) for each in found.effects)
    return replace(found, effects=effects)


def same(one: Any, other: Any) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    if hasattr(one, "__dataclass_fields__"):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[k], other[k]) for k in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float):
        return one.hex() == other.hex()
    return bool(one == other)


def disturbed(run: Run, where: np.ndarray) -> Run:
    """Other positions, speeds and torques, and masks, at the samples `where` (T,)."""
    rng = np.random.default_rng(5)
    n = run.q.shape[1]
    wave = 0.03 * np.sin(2 * np.pi * 7.0 * run.t[:, None] + np.arange(n))  # a new, faster line
    noise = rng.normal(size=run.tau.shape) * run.tau.std(axis=0)
    q = np.where(where[:, None], run.q + wave + 1e-4 * rng.normal(size=run.q.shape), run.q)
    tau = np.where(where[:, None], 1.3 * run.tau + noise + 2.0, run.tau)
    valid = run.usable() & ~(where[:, None] & (rng.random(run.tau.shape) < 0.02))
    dq = None if run.dq is None else np.where(where[:, None], 1.1 * run.dq, run.dq)
    return replace(run, q=q, tau=tau, dq=dq, valid=valid)


@pytest.fixture(scope="module")
def baseline(robot: Robot, base: BaseParameters, spec: Spec, dataset: Dataset) -> Diagnosis:
    """Of the data as they are, the last run held out."""
    return diagnose(robot, base, dataset, spec)


def everywhere(run: Run) -> np.ndarray:
    return np.ones(len(run.t), bool)


def test_a_held_out_run_is_used_for_the_errors_only(
    robot: Robot, base: BaseParameters, spec: Spec, dataset: Dataset, baseline: Diagnosis
) -> None:
    changed = replace(
        dataset, runs=(*dataset.runs[:2], disturbed(dataset.runs[2], everywhere(dataset.runs[2])))
    )
    one, other = baseline, diagnose(robot, base, changed, spec)
    assert one.held_out_run == "motion_3"
    assert one.effects  # something was chosen and fitted
    assert set(differences(one, other)) == FREE
    assert other.after.mean_relative > 2 * one.after.mean_relative


def with_friction(robot: Robot, base: BaseParameters, spec: Spec, still_there: bool) -> Diagnosis:
    """Of three runs with dry friction; it may be gone when the held-out one is recorded."""
    settings = SimulationSettings(rate=RATE, lead_in=0.5)
    first = simulate(robot, [motion(robot, i) for i in (1, 2)], settings, [friction()]).dataset
    effects = [friction()] if still_there else []
    last = simulate(robot, [motion(robot, 3)], settings, effects).dataset.runs
    only = spec.model_copy(
        update={"diagnosis": spec.diagnosis.model_copy(update={"kinds": ("coulomb_friction",)})}
    )
    return diagnose(robot, base, replace(first, runs=(*first.runs, *last)), only)


@pytest.fixture(scope="module")
def lubricated(robot: Robot, base: BaseParameters, spec: Spec) -> Diagnosis:
    return with_friction(robot, base, spec, still_there=False)


def test_what_is_there_is_confirmed_on_the_held_out_run(
    robot: Robot, base: BaseParameters, spec: Spec
) -> None:
    found = with_friction(robot, base, spec, still_there=True)
    (named,) = found.effects
    assert found.good
    assert named.verdict is HeldOutVerdict.CONFIRMED
    assert named.removes["elbow"].rms > 0.1
    assert found.untouched is not None
    assert found.untouched.mean_relative > found.after.mean_relative


def test_a_payload_that_the_held_out_run_is_wrongly_taken_to_be_without_is_harmful(
    baseline: Diagnosis,
) -> None:
    """It was found in one run, is in the held-out one as well, and nobody has said so."""
    verdicts = {each.effect.kind: each.verdict for each in baseline.effects}
    assert verdicts["payload"] is HeldOutVerdict.HARMFUL
    assert not baseline.good


def test_what_the_held_out_run_lacks_is_harmful(lubricated: Diagnosis) -> None:
    (named,) = lubricated.effects
    assert (named.effect.kind, named.effect.joints) == ("coulomb_friction", ("elbow",))
    assert named.verdict is HeldOutVerdict.HARMFUL
    assert lubricated.harmful == (named,)
    assert not lubricated.good


def test_one_effect_removes_all_that_is_removed(lubricated: Diagnosis) -> None:
    """Before is the same model without it, fitted to the same data in the same way."""
    before, after = lubricated.before, lubricated.after
    (named,) = lubricated.effects
    assert named.removes["elbow"].rms < -0.5
    for joint, removed in named.removes.items():
        assert removed.relative == before.relative[joint] - after.relative[joint]
        assert removed.rms == before.rms[joint] - after.rms[joint]
        assert removed.relative_moving == (
            before.relative_moving[joint] - after.relative_moving[joint]
        )


def test_what_is_assumed_of_the_held_out_run_is_told(baseline: Diagnosis) -> None:
    """The payload is found in the second run; nobody said that the held-out one has it."""
    (payload,) = [each for each in baseline.effects if each.effect.kind == "payload"]
    assert payload.effect.runs == ("motion_2",)
    joints = payload.effect.joints
    assumed = Assumption("payload", payload.effect.runs, ("motion_3",), False, joints)
    assert baseline.assumed == (assumed,)
    told = [each.text for each in baseline.findings if each.kind == "assumed"]
    assert told == [assumption_in_words(assumed)]
    assert "payload of slide in motion_2: taken to be absent in the held-out motion_3." in told[0]
    assert "runs: {motion_2: {payload: a}, motion_3: {payload: a}}" in told[0]
    (friction,) = (replace(assumed, kind="coulomb_friction", joints=("elbow",)),)
    assert "coulomb_friction of elbow in motion_2:" in assumption_in_words(friction)


def test_a_run_held_out_by_name_is_used_for_the_errors_only(
    robot: Robot, base: BaseParameters, spec: Spec, dataset: Dataset
) -> None:
    first = disturbed(dataset.runs[0], everywhere(dataset.runs[0]))
    changed = replace(dataset, runs=(first.cut(0, 700), *dataset.runs[1:]))
    one, other = (diagnose(robot, base, data, spec, "motion_1") for data in (dataset, changed))
    assert one.held_out_run == "motion_1"
    assert set(differences(one, other)) == FREE


def test_training_data_do_matter(
    robot: Robot, base: BaseParameters, spec: Spec, dataset: Dataset, baseline: Diagnosis
) -> None:
    """The comparison would see a leak: a slight change of one training sample shows everywhere."""
    run = dataset.runs[0]
    tau = run.tau.copy()
    tau[len(tau) // 2, 0] += 0.1
    changed = replace(dataset, runs=(replace(run, tau=tau), *dataset.runs[1:]))
    one, other = baseline, diagnose(robot, base, changed, spec)
    assert {"phi", "base_values", "information", "rounds", "processing"} <= set(
        differences(one, other)
    )


def test_held_out_blocks_of_a_single_run_are_used_for_the_errors_only(
    robot: Robot, base: BaseParameters, spec: Spec, dataset: Dataset
) -> None:
    run = joined(dataset.runs)
    whole = replace(dataset, runs=(run,))
    held_out = np.zeros(len(run.t), bool)
    for block in split(whole).held_out:
        held_out |= (run.t >= block.t[0] - 1e-9) & (run.t <= block.t[-1] + 1e-9)
    assert 0.2 < held_out.mean() < 0.4
    changed = replace(dataset, runs=(disturbed(run, held_out),))
    one, other = (diagnose(robot, base, data, spec) for data in (whole, changed))
    assert one.effects
    assert one.noise_floor  # two periods, seen past the held-out blocks
    assert set(differences(one, other)) == FREE
    assert other.after.mean_relative > 1.5 * one.after.mean_relative


def joined(runs: tuple[Run, ...]) -> Run:
    """The first run twice as long: the motion is periodic."""
    first = runs[0]
    period = len(first.t) / RATE

    def twice(x: Array) -> Array:
        return np.concatenate([x, x])

    t = np.concatenate([first.t, first.t + period])
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(len(t), first.tau.shape[1]))
    tau = twice(first.tau) + 0.01 * first.tau.std(axis=0) * noise
    dq = None if first.dq is None else twice(first.dq)
    return Run("only", t, twice(first.q), tau, dq)

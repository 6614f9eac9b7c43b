"""Odd data through the library's front door: the right answer, or one message."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from excite_cli.api.diagnosing import diagnose
from excite_cli.api.identifying import identify
from excite_cli.api.loading import Case
from excite_cli.api.planning import plan_after
from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ExciteError
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.stuck import mask_stuck
from excite_cli.robot.model import build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.simulation.arms import about_posture

KINDS = "diagnosis.kinds=[viscous_friction, coulomb_friction, contact, backlash]"


def case(*overrides: str) -> Case:
    spec = load_spec(SMOKE, [KINDS, *overrides])
    return Case(spec, SMOKE.parent, build_robot(spec.robot, SMOKE.parent))


@cache
def recorded(joints: str = "all", rate: float = 200.0) -> Dataset:
    """Three runs of the smoke arm, or of its elbow alone, with 3 N·m of dry friction there."""
    robot = case(*([] if joints == "all" else [f"robot.joints=[{joints}]"])).robot
    motions = [about_posture(robot, f"motion_{k}", k, 5.0) for k in (1, 2, 3)]
    friction = plant(kind_named("coulomb_friction"), (robot.joint_names.index("elbow"),), 3.0)
    data = simulate(robot, motions, SimulationSettings(rate=rate, lead_in=0.3), [friction]).dataset
    return each(data, lambda run: replace(run, extra={}, dq=None))


def each(data: Dataset, change: Callable[[Run], Run]) -> Dataset:
    return replace(data, runs=tuple(map(change, data.runs)))


def dry_friction(found: Diagnosis) -> tuple[float, float]:
    """Value and deviation of the elbow's, the only effect that there is."""
    (named,) = found.named
    assert (named.effect.kind, named.effect.joints) == ("coulomb_friction", ("elbow",))
    size = named.parameters["coulomb"]
    return size.value, size.std


def test_a_robot_with_one_moved_joint() -> None:
    found = diagnose(case("robot.joints=[elbow]"), recorded("elbow"))
    assert dry_friction(found)[0] == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize(
    ("runs", "words"), [(1, "share a motion"), (2, "is different in"), (3, "")]
)
def test_what_one_recording_cannot_say(runs: int, words: str) -> None:
    data = recorded("elbow")
    found = diagnose(case("robot.joints=[elbow]"), replace(data, runs=data.runs[:runs]))
    texts = [each.text for each in found.findings if each.kind == "one run"]
    assert len(texts) == bool(words)
    assert all(words in text for text in texts)


def test_friction_of_a_joint_that_turned_one_way_is_an_offset_as_well() -> None:
    def one_way(run: Run) -> Run:
        return replace(run, valid=np.gradient(run.q, run.t, axis=0) > 0.02)

    both = "effects=[{kind: coulomb_friction, joints: all}, {kind: torque_offset, joints: all}]"
    given = case("robot.joints=[elbow]", both, "diagnosis.rounds=0")
    data = each(recorded("elbow"), one_way)
    for found in (identify(given, data), diagnose(given, data)):
        (note,) = (each.text for each in found.findings if each.kind == "not_seen")
        assert "coulomb_friction.coulomb[elbow]" in note
        assert "torque_offset.offset[elbow]" in note


def test_what_was_tested_and_not_found_is_kept_for_the_next_motion() -> None:
    own = case("robot.joints=[elbow]", "criterion.kind=predicted_torque")
    found = diagnose(own, recorded("elbow"))
    about = found.information
    kinds = {each.kind for each in about.possible}
    assert kinds == {"viscous_friction"}
    columns = about.rank + len((*about.model, *about.rivals, *about.possible))
    assert about.factor.shape == (columns, columns)
    planned = plan_after(own, found, tell=lambda note: None)
    assert "coulomb_friction" in {each.kind for each in planned.problem.extension.effects}
    assert kinds <= {each.kind for each in planned.problem.extension.effects}


@pytest.mark.long
def test_stale_messages_change_neither_names_nor_sizes() -> None:
    """3 % of the samples at 500 Hz: hardly an average is free of them, and hardly one is lost."""
    data, rng = recorded(rate=500.0), np.random.default_rng(0)

    def stale(run: Run) -> Run:
        late = rng.uniform(size=len(run.t)) < 0.03
        late[0] = False
        held = np.maximum.accumulate(np.where(late, 0, np.arange(len(run.t))))
        spoilt = replace(run, q=run.q[held], tau=run.tau[held])
        return mask_stuck(spoilt, data.joint_names)[0]

    found = [diagnose(case(), given) for given in (data, each(data, stale))]
    (right, std), (value, _) = map(dry_friction, found)
    assert abs(value - right) < 2 * std
    counts = [each_.after.samples["elbow"] for each_ in found]
    assert counts[1] == counts[0] > 50
    errors = [each_.after.mean_relative for each_ in found]
    assert errors[1] == pytest.approx(errors[0], rel=0.15)


ODD: dict[str, tuple[Callable[[Run], Run], str]] = {
    "no torque": (lambda run: replace(run, tau=np.zeros_like(run.tau)), "torques are constant"),
    "no motion": (lambda run: replace(run, q=np.tile(run.q[0], (len(run.t), 1))), "no joint moves"),
    "two samples": (lambda run: run.cut(0, 2), "too short|only 2 samples"),
    "noise for positions": (
        lambda run: replace(run, q=np.random.default_rng(0).normal(size=run.q.shape)),
        "positions jump by",
    ),
    "everything masked": (
        lambda run: replace(run, valid=np.zeros(run.tau.shape, bool)),
        "no joint moves faster",
    ),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("command", [diagnose, identify])
def test_one_message(name: str, command: Callable[[Case, Dataset], object]) -> None:
    change, words = ODD[name]
    with pytest.raises(ExciteError, match=words):
        command(case(), each(recorded(), change))


def test_blocks_of_a_few_samples_are_refused() -> None:
    one = replace(recorded(), runs=recorded().runs[:1])
    with pytest.raises(ExciteError, match=r"diagnosis\.block: blocks of 0\.001 s"):
        diagnose(case("diagnosis.block=1e-3"), one)

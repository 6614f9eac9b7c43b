"""Effects planted in MuJoCo robots are named: fast representatives of the battery.

The cases come from a development seed; `python -m benchmarks.battery` judges on others.
"""

import pytest
from threadpoolctl import threadpool_limits

from benchmarks.battery.judge import Outcome, judge

pytest.importorskip("mujoco")

SEED = 12
# (case, what is planted): kinds that go different ways through simulation and search.
PLANTED = {
    10: "load_dependent_friction",
    11: "base_tilt",
    15: "ripple",
    22: "contact",
    23: "position_friction",
    27: "elasticity",
    58: "armature",
}
CLEAN = (7, 8)


def outcome(index: int, seed: int = SEED) -> Outcome:
    with threadpool_limits(1):
        return judge(seed, index).outcome


@pytest.mark.parametrize("index", PLANTED)
def test_what_was_planted_is_named_and_nothing_else(index: int) -> None:
    found = outcome(index)
    assert [p["kind"] for p in found.planted] == [PLANTED[index]]
    assert found.right, found.named
    assert not found.wrong, found.named
    assert found.ratio < 1.1  # of the error of the fit that knows the truth


@pytest.mark.parametrize("index", CLEAN)
def test_nothing_is_named_where_nothing_is_missing(index: int) -> None:
    found = outcome(index)
    assert found.planted == []
    assert found.named == []


def test_what_has_no_name_gets_none() -> None:
    found = outcome(2, seed=13)  # gears that rub on a sum of speeds, three joints apart
    assert not found.wrong, found.named
    told = {each["joint"]: each["depends_on"] for each in found.unexplained}
    assert set(told) == {"shoulder_pan_joint", "wrist_1_joint"}
    assert "v[wrist_1_joint]" in told["shoulder_pan_joint"]


def test_what_only_comes_near_is_told_as_an_approximation() -> None:
    found = outcome(40, seed=13)  # a spring that hardens
    assert [p["kind"] for p in found.planted] == ["outside:hardening_spring"]
    assert "spring" in {each["kind"] for each in found.named}
    for each in found.named:  # a wave beside the line comes nearer still, and is no better a name
        assert each["judged"] == "approximation"
        assert each["approximates"] == "a function of q[panda_joint4]"

"""What a residual depends on, as a record: its code in files, and what effects it is like."""

import pytest

from excite_cli.diagnosis.covariate import Aspect, Covariate


@pytest.mark.parametrize(
    ("code", "covariate"),
    [
        ("time", Covariate("time")),
        ("q[elbow]", Covariate("position", "elbow")),
        ("v[a b]", Covariate("speed", "a b")),
        ("a[time]", Covariate("acceleration", "time")),
        ("load[q[1]]", Covariate("load", "q[1]")),
        ("history of q[elbow]", Covariate("position", "elbow", Aspect.HISTORY)),
        ("direction and q[elbow]", Covariate("position", "elbow", Aspect.DIRECTION)),
        ("own history of load", Covariate("load", "", Aspect.HISTORY, own=True)),
        ("own load", Covariate("load", own=True)),
        ("column[temp [°C]]", Covariate("covariate", "temp [°C]")),
    ],
)
def test_a_code_stands_for_one_covariate(code: str, covariate: Covariate) -> None:
    assert covariate.code == code
    assert Covariate.of_code(code) == covariate


@pytest.mark.parametrize("code", ["", "x[elbow]", "q[]", "past of q[elbow]", "q[elbow] or v"])
def test_another_text_is_none(code: str) -> None:
    with pytest.raises(ValueError, match="nothing that a residual may depend on"):
        Covariate.of_code(code)


def test_what_each_joint_has_of_its_own_loses_its_name() -> None:
    load = Covariate("load", "elbow")
    assert load.common == Covariate("load", own=True)
    past = Covariate("position", "elbow", Aspect.HISTORY)
    assert past.common == Covariate("position", "", Aspect.HISTORY, own=True)
    column = Covariate("covariate", "temp", Aspect.DIRECTION)
    assert column.common == column
    angle = Covariate("position", "elbow")
    assert angle.common == angle


def test_hysteresis_of_motion_is_like_friction() -> None:
    assert Covariate("position", "elbow", Aspect.HISTORY).like == "speed"
    assert Covariate("position", "elbow", Aspect.DIRECTION).like == "speed"
    assert Covariate("position", "elbow").like == "position"
    assert Covariate("load", "elbow", Aspect.HISTORY).like == "load"

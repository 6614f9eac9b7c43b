"""What a residual depends on, as a record: its code in files, and what effects it is like."""

import pytest

from excite_cli.diagnosis.covariate import Covariate


@pytest.mark.parametrize(
    ("code", "covariate"),
    [
        ("time", Covariate("time")),
        ("q[elbow]", Covariate("position", "elbow")),
        ("v[a b]", Covariate("speed", "a b")),
        ("a[time]", Covariate("acceleration", "time")),
        ("load[q[1]]", Covariate("load", "q[1]")),
        ("history of q[elbow]", Covariate("position", "elbow", True)),
        ("own history of load", Covariate("load", "", True, own=True)),
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


@pytest.mark.parametrize(
    ("of", "common", "like"),
    [
        (Covariate("load", "elbow"), Covariate("load", own=True), "load"),
        (
            Covariate("position", "elbow", True),  # hysteresis is like friction
            Covariate("position", "", True, own=True),
            "speed",
        ),
        (Covariate("covariate", "temp"), None, None),
        (Covariate("position", "elbow"), None, "position"),
    ],
)
def test_what_each_joint_has_of_its_own_loses_its_name(
    of: Covariate, common: Covariate | None, like: str | None
) -> None:
    assert of.common == (common or of)
    assert like in (None, of.like)
    assert Covariate("load", "elbow", True).like == "load"

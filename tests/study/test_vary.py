"""What --vary says, and all combinations of it."""

import pytest

from excite_cli.errors import ConfigError
from excite_cli.study.vary import VariedKey, combinations, parse_vary


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("seed=1..4", ("1", "2", "3", "4")),
        ("seed=7, 9..10", ("7", "9", "10")),
        ("constraints.torque=null,{scale: 0.5}", ("null", "{scale: 0.5}")),
        ("robot.joints=[a, b],[c]", ("[a, b]", "[c]")),
        ("robot.urdf='a,b.urdf',c.urdf", ("'a,b.urdf'", "c.urdf")),
    ],
)  # fmt: skip
def test_values(text: str, values: tuple[str, ...]) -> None:
    assert parse_vary(text) == VariedKey(text.partition("=")[0], values)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("seed", "write key.path=VALUE"),
        ("=1,2", "write key.path=VALUE"),
        ("seed=1,,2", "a value is missing"),
        ("seed=", "a value is missing"),
        ("seed=1..3,2", "2 is given twice"),
        ("seed=4..1", "must go upwards"),
        ("seed=1..999999999", "must go upwards, over at most"),
    ],
)
def test_what_cannot_be_read_is_said(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_vary(text)


def test_all_combinations_the_last_key_fastest() -> None:
    both = combinations([VariedKey("a", ("1", "2")), VariedKey("b", ("x", "y"))])
    assert [tuple(each.values()) for each in both] == [
        ("1", "x"), ("1", "y"), ("2", "x"), ("2", "y"),
    ]  # fmt: skip
    assert combinations([]) == [{}]
    with pytest.raises(ConfigError, match="given twice"):
        combinations([VariedKey("a", ("1",)), VariedKey("a", ("2",))])
    long = tuple(map(str, range(1000)))
    with pytest.raises(ConfigError, match="1000000 combinations"):
        combinations([VariedKey("a", long), VariedKey("b", long)])

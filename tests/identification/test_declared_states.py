"""States of runs: one label is one set of runs; what does not fit the data is refused."""

import pytest

from excite_cli.config.load import parsed_spec
from excite_cli.errors import ConfigError
from excite_cli.identification.declared_states import check_states, declared_sets

NAMES = ("monday", "tuesday", "friday")
STATES = {
    "monday": {"payload": "tool"},
    "tuesday": {"payload": "none", "torque_gain": "old"},
    "friday": {"payload": "tool"},
}


def test_runs_of_one_label_are_one_set_and_none_is_in_none() -> None:
    assert declared_sets("payload", STATES) == [("monday", "friday")]
    assert declared_sets("torque_gain", STATES) == [("tuesday",)]
    assert declared_sets("payload", {"monday": {"payload": "none"}}) == []
    assert declared_sets("contact", STATES) is None


def test_the_config_takes_them_and_refuses_numbers() -> None:
    robot = {"urdf": "arm.urdf"}
    assert parsed_spec({"robot": robot, "runs": STATES}).runs == STATES
    with pytest.raises(ConfigError, match="runs"):
        parsed_spec({"robot": robot, "runs": {"monday": {"payload": 2}}})


@pytest.mark.parametrize(
    ("states", "told"),
    [
        ({"tuesdy": {"payload": "a"}}, "no run 'tuesdy' in the data. Did you mean 'tuesday'?"),
        ({"monday": {"paylod": "a"}}, "runs.monday: there is no effect 'paylod'"),
        ({"monday": {"spring": "a"}}, "runs.monday: spring is not of single runs."),
    ],
)
def test_unknown_runs_and_kinds_are_refused(states: dict, told: str) -> None:
    with pytest.raises(ConfigError) as error:
        check_states(states, NAMES)
    assert told in str(error.value)


def test_what_fits_is_accepted() -> None:
    check_states({**STATES, "friday": {"contact": "a", "viscous_friction": "b"}}, NAMES)

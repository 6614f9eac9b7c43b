"""One line for a fault, however many joints and runs have it."""

from excite_cli.measurement.dataset import Finding, joined, merged


def test_the_first_is_told_and_where_the_others_are() -> None:
    findings = [
        Finding("stuck", "warning", "torque of a stands at 1", "run_1", ("a",)),
        Finding("stuck", "warning", "torque of b stands at 2", "run_1", ("b",)),
        Finding("stuck", "warning", "torque of b stands at 3", "run_2", ("b",)),
        Finding("gap", "warning", "a gap", "run_2"),
    ]
    stuck, gap = merged(findings)
    assert stuck.text == "torque of a stands at 1; likewise b (run_1, run_2)"
    assert (stuck.run, stuck.joints) == ("run_1", ("a", "b"))
    assert gap == findings[-1]


def test_the_same_of_several_runs_lists_them() -> None:
    (one,) = merged(Finding("jitter", "note", "stamps jitter", run) for run in ("a", "b"))
    assert (one.text, one.run) == ("stamps jitter", "a, b")


def test_severities_and_what_is_about_no_place_stay_apart() -> None:
    findings = [
        Finding("held", "warning", "x", "a"),
        Finding("held", "note", "y", "a"),
        Finding("assumed", "warning", "one thing"),
        Finding("assumed", "warning", "another"),
    ]
    assert merged(findings) == findings


def test_long_lists_are_cut() -> None:
    findings = [Finding("nan", "warning", f"{k}", "", (f"j{k}",)) for k in range(20)]
    assert merged(findings)[0].text.endswith("j8, and 11 more")


def test_settings_of_both_hold_and_numbers_are_those_of_the_later() -> None:
    one = {"robot.base_orientation": [0.1, 0.0, 0.0], "measurement.without_torque": ["a"]}
    other = {"robot.base_orientation": [0.2, 0.0, 0.0], "measurement.without_torque": ["b", "a"]}
    assert joined(one, other) == {
        "robot.base_orientation": [0.2, 0.0, 0.0],
        "measurement.without_torque": ["a", "b"],
    }

"""A config with some values changed keeps its comments."""

from excite_cli.config.commented_yaml import amended, changed_values, with_values
from excite_cli.config.load import parse_spec

TEXT = """\
# our arm
robot:
  urdf: arm.urdf  # from the drawing
measurement: {torque: link}
effects: [{kind: viscous_friction}]  # by the data sheet
"""


def test_comments_and_order_stay() -> None:
    settings = {"robot.base_orientation": [1.5708, 0.0, 0.0], "measurement.sign": {"elbow": -1}}
    text = amended(TEXT, settings)
    assert text.splitlines()[0] == "# our arm"
    assert "urdf: arm.urdf  # from the drawing" in text
    assert "[{kind: viscous_friction}]  # by the data sheet" in text
    spec = parse_spec(text)
    assert spec.robot.base_orientation == (1.5708, 0.0, 0.0)
    assert spec.measurement.sign == {"elbow": -1}
    assert spec.measurement.torque == "link"


def test_a_section_that_is_not_there_is_added() -> None:
    spec = parse_spec(amended("robot: {urdf: a.urdf}\n", {"measurement.time": "ms"}))
    assert spec.measurement.time == "ms"


def test_plain_values() -> None:
    tree = {"robot": {"urdf": "a"}, "measurement": {"time": "ms"}}
    found = with_values(tree, {"measurement.angle": "deg", "seed": 2})
    measurement = {"time": "ms", "angle": "deg"}
    assert found == {"robot": {"urdf": "a"}, "measurement": measurement, "seed": 2}
    assert tree["measurement"] == {"time": "ms"}


def test_what_is_other_than_before() -> None:
    old = {"seed": 1, "robot": {"urdf": "a"}, "measurement": {"sign": {"a.b": 1}, "time": "s"}}
    new = {"seed": 1, "robot": {"urdf": "b"}, "measurement": {"sign": {"a.b": -1}, "time": "s"}}
    changed = changed_values(old, new)
    assert changed == {"robot.urdf": "b", "measurement.sign": {"a.b": -1}}
    assert with_values(old, changed) == new

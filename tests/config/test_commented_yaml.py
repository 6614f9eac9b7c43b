"""YAML with comments beside the keys loads to the same values; with some changed it keeps them."""

import yaml

from excite_cli.config.commented_yaml import (
    amended,
    changed_values,
    commented_yaml,
    with_values,
)
from excite_cli.config.load_spec import parse_spec

TREE = {
    "robot": {"urdf": "a.urdf", "joints": [f"a_long_name_of_joint_{k}" for k in range(9)]},
    "limits": {"j: 1": {"velocity": 3.1, "position": [-1.0, 1e-7]}},
    "seed": 1,
}


def test_values_come_back() -> None:
    comments = {
        ("robot", "joints"): "long " * 40,
        ("limits", "j: 1", "velocity"): "assumed",
        ("seed",): "any",
    }
    assert yaml.safe_load(commented_yaml(TREE, comments, "two\nlines")) == TREE


def test_a_comment_stands_beside_its_key() -> None:
    text = commented_yaml(TREE, {("limits", "j: 1", "velocity"): "assumed"})
    assert "    velocity: 3.1  # assumed" in text.splitlines()


def test_a_long_comment_stands_above_and_no_line_is_long() -> None:
    text = commented_yaml(TREE, {("seed",): "many words " * 20})
    lines = text.splitlines()
    assert lines[lines.index("seed: 1") - 1].startswith("# ")
    assert max(map(len, lines)) <= 100


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

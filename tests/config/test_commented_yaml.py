"""YAML with comments beside the keys loads to the same values."""

import yaml

from excite_cli.config.commented_yaml import commented_yaml

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

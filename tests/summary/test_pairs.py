"""Verdicts say of how many pairs they speak, and which are left out."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from excite_cli.api.loading import load_problem
from excite_cli.errors import ConfigError
from excite_cli.geometry.reasons import Why
from excite_cli.summary.pairs import (
    bodies_without_shapes,
    kept_apart,
    pairs_data,
    pairs_in_words,
    unjudged,
)

from .two_arms import two_arms

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def test_all_pairs_are_kept_apart() -> None:
    problem = load_problem(SMOKE)
    assert kept_apart(problem) == 7
    assert unjudged(problem) == []
    assert pairs_in_words(problem) == ["Self-collision: all 7 relevant link pairs checked."]


def test_pairs_that_are_ignored_are_counted_and_named() -> None:
    ignored = "constraints.self_collision.ignore=[[base, wrist]]"
    problem = load_problem(SMOKE, [ignored])
    left = unjudged(problem)
    assert {pair.reason.why for pair in left} == {Why.IGNORED}
    told = pairs_in_words(problem)[0]
    total = kept_apart(problem) + len(left)
    assert f"{kept_apart(problem)} of {total} relevant link pairs" in told
    assert "base – wrist: ignored in the config" in told
    data = pairs_data(problem)
    assert data["kept_apart"] == kept_apart(problem) < 7
    assert data["not_kept_apart"][0]["pair"] == ["base", "wrist"]
    assert data["not_kept_apart"][0]["why"] == "ignored"


def carrying(radius: float) -> str:
    return (
        f"robot.payload={{link: wrist, mass: 1.0, center: [0, 0, 0.05], start: [0, 0, 0], "
        f"end: [0, 0, 0.1], radius: {radius}}}"
    )


def test_a_payload_that_always_touches_is_told_with_its_depth() -> None:
    problem = load_problem(SMOKE, [carrying(1.0)])
    told = " ".join(pairs_in_words(problem))
    (left,) = [pair for pair in unjudged(problem) if pair.first == "base"]
    assert left.second == "payload"
    assert f"base – payload: always in contact (up to {left.reason.distance:.3f} m deep)" in told
    # The capsules overlap by their radii less the distance of their axes, at most 1.2 m here.
    assert 0.1 < left.reason.distance < 1.2


@pytest.mark.parametrize(
    ("given", "where"),
    [
        (carrying(40.0), "robot.payload"),
        (
            "constraints.self_collision.capsules={wrist: {start: [0, 0, 0], end: [0, 0, 90], "
            "radius: 0.05}}",
            "constraints.self_collision.capsules.wrist",
        ),
    ],
)
def test_a_capsule_larger_than_the_robot_is_refused(given: str, where: str) -> None:
    with pytest.raises(ConfigError, match=f"{where}: a .* m is larger than .* reach"):
        load_problem(SMOKE, [given])


def test_links_without_shapes_are_told(tmp_path: Path) -> None:
    text = (SMOKE.parents[1] / "data" / "smoke_arm.urdf").read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    for link in root.findall("link"):
        if link.get("name") == "forearm":
            for shape in link.findall("collision"):
                link.remove(shape)
    (tmp_path / "arm.urdf").write_text(ElementTree.tostring(root, encoding="unicode"))
    problem = load_problem(SMOKE, [f"robot.urdf={tmp_path / 'arm.urdf'}"])
    assert bodies_without_shapes(problem) == ["elbow"]
    told = pairs_in_words(problem)
    assert "NOT GUARDED: what moves with elbow (forearm" in told[0]
    assert "checked." in told[1]
    assert pairs_data(problem)["not_guarded"] == ["elbow"]
    assert pairs_data(load_problem(SMOKE))["not_guarded"] == []


def test_two_arms_with_shapes_on_their_last_links_only(tmp_path: Path) -> None:
    """No verdict on the last links may be taken for one on the arms."""
    urdf = two_arms(tmp_path / "two.urdf")
    config = tmp_path / "two.yaml"
    config.write_text(
        f"robot: {{urdf: {urdf}}}\ntrajectory: {{family: fourier, base_frequency: 0.6}}\n"
        "constraints: {self_collision: {}}\n"
    )
    bare = load_problem(config)
    arms = [f"{side}_{k}" for side in ("left", "right") for k in range(1, 7)]
    assert bodies_without_shapes(bare) == arms
    assert kept_apart(bare) == 1
    told = pairs_in_words(bare)
    assert "NOT GUARDED: what moves with left_1 (left_link_1), left_2" in told[0]
    assert told[1] == ("Self-collision: 1 of 1 relevant link pairs with collision shapes checked.")
    shown = load_problem(config, ["constraints.self_collision.shapes=visual"])
    assert bodies_without_shapes(shown) == []
    assert kept_apart(shown) > 30

"""Verdicts say of how many pairs they speak, and which are left out."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from excite_cli.api.loading import load_problem
from excite_cli.geometry.reasons import Why
from excite_cli.summary.pairs import (
    kept_apart,
    not_guarded,
    pairs_data,
    pairs_in_words,
    unjudged,
)

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def test_all_pairs_are_kept_apart() -> None:
    problem = load_problem(SMOKE)
    assert kept_apart(problem) == 7
    assert unjudged(problem) == []
    assert pairs_in_words(problem) == [
        "Verdicts speak of 7 of 7 pairs of bodies, all that could come near each other."
    ]


def test_pairs_that_are_ignored_are_counted_and_named() -> None:
    ignored = "constraints.self_collision.ignore=[[base, wrist]]"
    problem = load_problem(SMOKE, [ignored])
    left = unjudged(problem)
    assert {pair.reason.why for pair in left} == {Why.IGNORED}
    told = pairs_in_words(problem)[0]
    total = kept_apart(problem) + len(left)
    assert f"{kept_apart(problem)} of {total} pairs" in told
    assert "base – wrist: ignored in the config" in told
    data = pairs_data(problem)
    assert data["kept_apart"] == kept_apart(problem) < 7
    assert data["not_kept_apart"][0]["pair"] == ["base", "wrist"]
    assert data["not_kept_apart"][0]["why"] == "ignored"


@pytest.mark.parametrize("radius", [1.0, 40.0])
def test_a_payload_of_impossible_size_is_not_passed_over(radius: float) -> None:
    payload = (
        f"robot.payload={{link: wrist, mass: 1.0, center: [0, 0, 0.05], start: [0, 0, 0], "
        f"end: [0, 0, 0.1], radius: {radius}}}"
    )
    problem = load_problem(SMOKE, [payload])
    told = " ".join(pairs_in_words(problem))
    assert "payload" in told
    assert "always in contact" in told


def test_links_without_shapes_are_told(tmp_path: Path) -> None:
    text = (SMOKE.parents[1] / "data" / "smoke_arm.urdf").read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    for link in root.findall("link"):
        if link.get("name") == "forearm":
            for shape in link.findall("collision"):
                link.remove(shape)
    (tmp_path / "arm.urdf").write_text(ElementTree.tostring(root, encoding="unicode"))
    problem = load_problem(SMOKE, [f"robot.urdf={tmp_path / 'arm.urdf'}"])
    assert not_guarded(problem) == ["elbow"]
    told = pairs_in_words(problem)
    assert "NOT GUARDED: what moves with elbow (forearm" in told[0]
    assert "speak of" in told[1]
    assert pairs_data(problem)["not_guarded"] == ["elbow"]
    assert pairs_data(load_problem(SMOKE))["not_guarded"] == []

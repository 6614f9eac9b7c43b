"""What counts as named alone, effects as words, and the page of records made up by hand."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.battery.cases import kinds
from benchmarks.robots.journey import judged
from benchmarks.robots.page import page
from benchmarks.robots.planting import words
from benchmarks.robots.sources import Source, sources
from excite_cli.api.loading import load_case
from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.payload import Payload
from excite_cli.simulation.ground_truth import PlantedEffect

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"
PLANT = {
    "effects": ["spring@elbow=3"],
    "kind": "spring",
    "joints": ["elbow"],
    "touched": ["elbow"],
    "companions": [],
    "moved": 3,
    "friction": False,
}


def named(kind: str, joint: str, *aliases: str) -> dict[str, Any]:
    return {
        "kind": kind,
        "joints": [joint],
        "runs": ["motion_1"],
        "alias_set": [{"kind": alias, "joints": [joint]} for alias in aliases],
    }


def answer(*effects: dict[str, Any], **more: Any) -> dict[str, Any]:
    errors = {"mean_relative_moving": 0.1}
    empty = {"approximations": [], "absorbed": [], "unexplained": [], "findings": []}
    return {
        "effects": list(effects),
        "answer": "a sentence",
        "error": {"before": errors, "after": errors},
        **empty,
        **more,
    }


@pytest.mark.parametrize(
    ("effects", "right", "alone"),
    [
        ([named("spring", "elbow")], True, True),
        ([named("ripple", "elbow", "spring")], True, True),
        ([named("ripple", "elbow", "a", "b", "c", "spring")], False, False),
        ([named("spring", "elbow"), named("ripple", "wrist")], True, False),
        ([named("ripple", "elbow", "spring"), named("armature", "elbow", "spring")], True, False),
        ([named("spring", "wrist")], False, False),
        ([], False, False),
    ],
)
def test_what_counts(effects: list[dict[str, Any]], right: bool, alone: bool) -> None:
    found = judged(answer(*effects), PLANT)
    assert (found["right"], found["alone"]) == (right, alone)


def test_an_effect_told_as_the_parts_that_it_is_made_of_is_named_alone() -> None:
    plant = {**PLANT, "kind": "asymmetric_friction"}
    parts = [named("coulomb_friction", "elbow"), named("torque_offset", "elbow")]
    assert judged(answer(*parts), plant)["alone"]
    assert not judged(answer(*parts, named("spring", "elbow")), plant)["alone"]
    assert not judged(answer(parts[0]), plant)["right"]


def test_what_is_only_called_an_approximation_does_not_count() -> None:
    one = named("spring", "elbow")
    found = judged(answer(one, approximations=[one]), PLANT)
    assert not found["right"]


def test_effects_are_the_same_once_they_are_read_again() -> None:
    """Every kind that is drawn, at its first place, with numbers of its own."""
    robot = load_case(SMOKE, ()).robot
    rng = np.random.default_rng(1)
    takes = {"motion_1": ("motion_1",)}
    for name in kinds():
        kind = kind_named(name)
        places = kind.places(robot)
        for joints in places[:1]:
            shape = {each.name: float(rng.uniform(each.low, each.high)) for each in kind.shapes}
            values = np.array([rng.uniform(each.low, each.high) for each in kind.parameters])
            if kind.known_by:
                values = np.array([1.0])
            text = words(PlantedEffect(kind(joints, shape), values), robot, takes)
            assert text.startswith(f"{name}@")


def test_a_payload_of_one_of_two_arms_stays_where_it_is() -> None:
    robot = load_case(SMOKE.with_name("talos_arms.yaml"), ()).robot
    values = np.array([1.5, 0.0, 0.0, 0.15, 0.02, 0.0, 0.02, 0.0, 0.0, 0.01])
    for joints in Payload.places(robot):
        assert robot.joint_names[joints[0]] in words(
            PlantedEffect(Payload(joints), values), robot, {}
        )


RECORDS = [
    (
        Source("a one", "URDF", ()),
        {
            "robot": "a one",
            "format": "URDF",
            "seconds": {"init": 1.0, "optimize": 9.0, "diagnose": 4.0},
            "joints": 3,
            "base_parameters": 12,
            "condition_number": 3.456,
            "ignored_pairs": 2,
            "proved": True,
            "admissible": True,
            "planted": PLANT,
            "diagnosis": judged(answer(named("spring", "elbow")), PLANT),
        },
    ),
    (
        Source("b two", "SDF", ()),
        {
            "robot": "b two",
            "format": "SDF",
            "seconds": {"init": 1.0},
            "failed": "init",
            "message": "/some/where/robot.sdf has a fault",
        },
    ),
]


def test_the_page_counts_and_tells() -> None:
    there = [(source, json.loads(json.dumps(record))) for source, record in RECORDS]
    text = page(there, [*(source for source, _ in there), Source("c", "URDF", ("--robot", "c"))], 7)
    assert "2 of the 2 robots of these packages and 0 of the 1 of example" in text
    assert "| URDF | 1 | 1 | 1 | 1 | 0 | 0 |" in text
    assert "| SDF | 1 | 0 | 0 | 0 | 0 | 0 |" in text
    assert "| all | 2 | 1 | 1 | 1 | 0 | 0 |" in text
    row = "| 3 | 12 | 3.46 | 2 | 1.0 | 9.0 | spring of elbow | spring of elbow | proved; named al"
    assert row in text
    assert "| init: robot.sdf has a fault |" in text
    assert "seed 7" in text


def test_robots_come_by_turns_of_four_formats(tmp_path: Path) -> None:
    found = [each for each in sources(tmp_path) if each.given[0] == "--urdf"]
    assert len(found) > 60
    assert [each.format for each in found[:4]] == ["URDF", "xacro", "MJCF", "SDF"]
    assert len({each.name for each in sources(tmp_path)}) == len(sources(tmp_path))
    assert all(each.given[0] == "--robot" for each in sources(None))

"""Which pairs of capsules are checked, why others are not, and the words for it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.constraints.self_collision import Clearance
from excite_cli.geometry import collision_pairs
from excite_cli.geometry.collision_pairs import (
    CollisionPairs,
    choose_pairs,
    store_reasons,
    stored_reasons,
)
from excite_cli.geometry.reasons import (
    ContactMeaning,
    DroppedPair,
    LinksApart,
    Reason,
    Why,
    dropped_in_words,
    reason_in_words,
    standing_in_words,
)
from excite_cli.robot.capsule import Capsule

from .fitted_robots import capsules_of, pairs_of, robot_of

NAMES = ["talos", "ur10", "panda"]


def reasons(pairs: CollisionPairs) -> dict[frozenset[str], str]:
    return {
        frozenset((pair.first, pair.second)): reason_in_words(pair.reason) for pair in pairs.dropped
    }


def checked(name: str) -> set[frozenset[str]]:
    capsules = capsules_of(name)
    return {frozenset((capsules[i].name, capsules[j].name)) for i, j in pairs_of(name).checked}


@pytest.mark.parametrize(("name", "least"), [("talos", 0.01), ("ur10", 0.01), ("panda", 0.005)])
def test_every_pair_is_either_checked_or_dropped(name: str, least: float) -> None:
    robot, capsules, pairs = robot_of(name), capsules_of(name), pairs_of(name)
    count = len(capsules)
    assert len(pairs.checked) + len(pairs.dropped) == count * (count - 1) // 2
    assert not checked(name) & set(reasons(pairs))
    distances = Clearance(robot, capsules, pairs).distances(robot.posture[None])
    assert distances.min() > least, "the posture is clear"


def test_reasons() -> None:
    found = reasons(pairs_of("panda"))
    assert found[frozenset(("panda_link7", "panda_hand"))] == "same body"
    assert found[frozenset(("panda_link2", "panda_link3"))] == "adjacent"
    assert found[frozenset(("panda_link0", "panda_link2"))].startswith("never near")
    found = reasons(pairs_of("ur10"))
    # The base plate and the upper arm pass at 2 cm, which capsules do not resolve.
    assert found[frozenset(("base_link", "upper_arm_link"))].startswith("meshes never near")
    found = reasons(pairs_of("talos"))
    # The wrist sensor shares a capsule with link 7, which always touches link 5; it does not.
    wrist = found[frozenset(("arm_left_5_link", "arm_left_7_link"))]
    assert wrist.startswith("unguarded")
    assert "wrist_left_ft_link" in wrist
    assert "arm_left_7_link" not in wrist
    # What can really meet is checked.
    assert frozenset(("arm_left_5_link", "arm_right_5_link")) in checked("talos")
    assert frozenset(("torso_2_link", "arm_right_4_link")) in checked("talos")
    assert frozenset(("panda_link0", "panda_hand")) in checked("panda")


@pytest.mark.parametrize("name", NAMES)
def test_pairs_dropped_as_never_near_stay_apart(name: str) -> None:
    robot, capsules = robot_of(name), capsules_of(name)
    number = {capsule.name: index for index, capsule in enumerate(capsules)}
    never = [
        (number[pair.first], number[pair.second])
        for pair in pairs_of(name).dropped
        if pair.reason.why is Why.NEVER_NEAR
    ]
    q, _, _ = robot.draw_states(1500, seed=99)  # not the sample that the choice was made from
    distances = Clearance(robot, capsules, CollisionPairs(tuple(never), ())).distances(q)
    assert distances.min() > 0.03


def test_pairs_that_are_ignored_and_margins() -> None:
    """A margin that cannot be kept must make the problem infeasible, not the check vanish."""
    robot, capsules, usual = robot_of("panda"), capsules_of("panda"), pairs_of("panda")
    spec = SelfCollisionSpec(ignore=(("panda_hand", "panda_link0"),))
    found = reasons(choose_pairs(robot, capsules, spec, samples=200))
    assert found[frozenset(("panda_link0", "panda_hand"))] == "ignored in the config"
    wide = choose_pairs(robot, capsules, SelfCollisionSpec(margin=0.2), samples=500)
    assert (0, 3) in wide.checked  # nearer than 25 cm at times, never nearer than 6 cm
    assert (0, 3) not in usual.checked
    wider = choose_pairs(robot, capsules, SelfCollisionSpec(margin=5.0), samples=500)
    assert len(wider.checked) >= len(usual.checked)


def test_a_pair_that_random_postures_miss_is_found_by_descent() -> None:
    """Two small balls far out on the Panda meet only in a tiny share of all postures."""
    robot = robot_of("panda")
    ball = np.array([0.0, 0.0, 0.25])
    fixed = np.array([0.55, 0.1, 0.35])
    capsules = (
        Capsule("far", 0, fixed, fixed, 0.005, ("far",), by_hand=True),
        Capsule("tip", 7, ball, ball, 0.005, ("tip",), by_hand=True),
    )
    pairs = CollisionPairs(((0, 1),), ())
    q, _, _ = robot.draw_states(60, seed=0)
    assert Clearance(robot, capsules, pairs).distances(q).min() > 0.06
    chosen = choose_pairs(robot, capsules, SelfCollisionSpec(), samples=60, seed=0)
    assert chosen.checked == ((0, 1),)


def test_the_choice_is_kept_and_foreign_content_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    calls: list[int] = []
    real = collision_pairs._by_sampling
    monkeypatch.setattr(collision_pairs, "_by_sampling", lambda *a: calls.append(1) or real(*a))
    robot, capsules, spec = robot_of("ur10"), capsules_of("ur10"), SelfCollisionSpec(margin=0.012)
    first = choose_pairs(robot, capsules, spec)
    assert choose_pairs(robot, capsules, spec) == first
    assert len(calls) == 1
    assert choose_pairs(robot, capsules, spec, seed=1).checked == first.checked
    fatter = tuple(replace(capsule, radius=capsule.radius + 0.02) for capsule in capsules)
    choose_pairs(robot, fatter, spec)
    choose_pairs(robot, capsules, spec.model_copy(update={"margin": 0.02}))
    assert len(calls) == 4
    for content in (b"", b"no archive"):
        for file in tmp_path.glob("excite/meshes-*"):
            file.write_bytes(content)
        assert choose_pairs(robot, capsules, spec) == first
    assert len(calls) == 6


APART = (LinksApart("base", "arm", 0.5), LinksApart("base – x", "hand, left", 0.995))
TOLD = [
    (Reason(Why.SAME_BODY), "same body"),
    (Reason(Why.IGNORED), "ignored in the config"),
    (Reason(Why.BY_MESHES), "checked by their meshes, as configured"),
    (Reason(Why.ADJACENT), "adjacent"),
    (Reason(Why.OUT_OF_REACH), "out of reach"),
    (Reason(Why.NEVER_NEAR, 0.1234), "never near (at least 0.12 m found)"),
    (Reason(Why.MESHES_NEVER_NEAR, 0.1234), "meshes never near (at least 0.123 m found)"),
    (Reason(Why.ALWAYS_TOUCHING), "always in contact"),
    (Reason(Why.ALWAYS_TOUCHING, 0.0207), "always in contact (up to 0.021 m deep)"),
    (Reason(Why.ALWAYS_NEAR, 0.004), "always nearer than the margin (distance at least 0.004 m)"),
    (
        Reason(Why.UNGUARDED, 0.05, APART),
        "unguarded: capsules always overlap (up to 0.050 m deep; meshes separated: base – arm 50%, "
        "base – x – hand, left 100%)",
    ),
]


@pytest.mark.parametrize(("reason", "words"), TOLD)
def test_words(reason: Reason, words: str) -> None:
    assert reason_in_words(reason) == words
    assert dropped_in_words(DroppedPair("a", "b", reason)) == f"a – b: {words}"


def test_what_is_stored_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    reasons = [None, *(reason for reason, _ in TOLD)]
    store_reasons("key", reasons)
    assert stored_reasons("key", len(reasons)) == reasons
    assert stored_reasons("key", 3) is None
    assert stored_reasons("other", len(reasons)) is None
    assert {reason.why for reason, _ in TOLD} == set(Why), "every reason has words"
    assert [bool(standing_in_words(each)) for each in ContactMeaning] == [False, True, True, True]

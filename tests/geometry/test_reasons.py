"""Why pairs are not checked: kept as records, told in the same words as ever."""

from pathlib import Path

import pytest

from excite_cli.geometry.collision_pairs import store_reasons, stored_reasons
from excite_cli.geometry.reasons import (
    DroppedPair,
    LinksApart,
    Reason,
    Standing,
    Why,
    dropped_in_words,
    reason_in_words,
    standing_in_words,
)

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


def test_every_reason_has_words() -> None:
    assert {reason.why for reason, _ in TOLD} == set(Why)
    assert [bool(standing_in_words(each)) for each in Standing] == [False, True, True, True]


def test_what_is_stored_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    reasons = [None, *(reason for reason, _ in TOLD)]
    store_reasons("key", reasons)
    assert stored_reasons("key", len(reasons)) == reasons
    assert stored_reasons("key", 3) is None
    assert stored_reasons("other", len(reasons)) is None

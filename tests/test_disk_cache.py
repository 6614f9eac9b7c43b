from pathlib import Path

import numpy as np
import pytest

from excite_cli.disk_cache import store_arrays, stored_arrays

ARRAYS = {"values": np.arange(6.0).reshape(2, 3), "names": np.array(["a", "of b"])}


@pytest.fixture
def stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    store_arrays("k" * 64, ARRAYS)
    (path,) = (tmp_path / "excite").glob("meshes-*.npz")
    return path


def same(found: dict[str, np.ndarray] | None) -> bool:
    return found is not None and all(np.array_equal(found[name], ARRAYS[name]) for name in ARRAYS)


def test_what_is_stored_comes_back(stored: Path) -> None:
    found = stored_arrays("k" * 64)
    assert same(found)
    assert set(found or ()) == set(ARRAYS)


def test_no_flipped_bit_changes_what_comes_back(stored: Path) -> None:
    whole, refused = stored.read_bytes(), 0
    for place in range(len(whole)):
        for bit in (1, 128):
            stored.write_bytes(whole[:place] + bytes([whole[place] ^ bit]) + whole[place + 1 :])
            found = stored_arrays("k" * 64)
            assert found is None or same(found), place
            refused += found is None
    assert refused > len(whole)  # most bytes matter; the times in a zip do not


@pytest.mark.parametrize(
    "edit",
    [
        {"values": np.arange(6.0).reshape(3, 2)},
        {"values": np.arange(6).reshape(2, 3)},
        {"values": np.nextafter(ARRAYS["values"], 9)},
        {"names": np.array(["a", "of c"])},
        {"more": np.zeros(1)},
    ],
)
def test_edited_arrays_are_the_same_as_none(stored: Path, edit: dict[str, np.ndarray]) -> None:
    with np.load(stored) as content:
        arrays = dict(content)
    stored.unlink()
    np.savez_compressed(stored, **(arrays | edit))
    assert stored_arrays("k" * 64) is None


def test_what_was_stored_under_another_key_is_the_same_as_none(stored: Path) -> None:
    other = "m" * 64
    store_arrays(other, ARRAYS)
    (path,) = set(stored.parent.glob("meshes-*.npz")) - {stored}
    path.write_bytes(stored.read_bytes())
    assert stored_arrays(other) is None

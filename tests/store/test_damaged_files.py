"""Reading trusts nothing: every file that is not a whole result gives one message."""

import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.store.result_file import SCHEMA, read_result
from tests.store.conftest import Stored


def refused(path: Path) -> str:
    with pytest.raises(FileError) as caught:
        read_result(path)
    message = str(caught.value)
    assert str(path) in message
    return message


def test_missing_file_and_folder(tmp_path: Path) -> None:
    assert "There is no file" in refused(tmp_path / "none.h5")
    assert "There is no file" in refused(tmp_path)


@pytest.mark.parametrize("content", [b"", b"robot: {urdf: a.urdf}\n", b"\x89HDF\r\n\x1a\n"])
def test_not_hdf5(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "text.h5"
    path.write_bytes(content)
    assert "is not a readable HDF5 file" in refused(path)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_truncated(stored: Stored, tmp_path: Path, share: float) -> None:
    content = stored.path.read_bytes()
    path = tmp_path / "cut.h5"
    path.write_bytes(content[: int(share * len(content))])
    assert "is not a readable HDF5 file" in refused(path)


def test_foreign_hdf5(tmp_path: Path) -> None:
    path = tmp_path / "foreign.h5"
    with h5py.File(path, "w") as file:
        file["tau"] = np.zeros(3)
    message = refused(path)
    assert "not a result of this program" in message
    assert "excite optimize" in message


def test_another_program(copy: Path) -> None:
    with h5py.File(copy, "a") as file:
        file.attrs["program"] = np.arange(3)
    assert "not a result of this program" in refused(copy)


def test_newer_schema(copy: Path) -> None:
    with h5py.File(copy, "a") as file:
        file.attrs["schema"] = SCHEMA + 1
    message = refused(copy)
    assert f"has schema {SCHEMA + 1}" in message
    assert "Update the program" in message


def _factor(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[h5py.File], None]:
    def act(file: h5py.File) -> None:
        factor = file["stack/R"][()]
        rows = file["stack"].attrs["rows"]
        del file["stack"]
        file["stack/R"] = change(factor)
        file["stack"].attrs["rows"] = rows

    return act


@pytest.mark.parametrize(
    "change",
    [
        lambda factor: np.where(np.eye(len(factor), dtype=bool), np.nan, factor),
        lambda factor: np.where(factor == 0, np.inf, factor),
        lambda factor: factor[:-1],
        lambda factor: factor[:-1, :-1],
        lambda factor: factor[0],
        lambda factor: np.zeros((0, 0)),
        lambda factor: np.array([[b"R"]]),
    ],
    ids=["nan", "infinite", "not square", "smaller", "a row", "empty", "text"],
)
def test_corrupted_factor(copy: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    with h5py.File(copy, "a") as file:
        _factor(change)(file)
    message = refused(copy)
    assert "is damaged" in message or "is not a readable HDF5 file" in message


def _spoil_coefficients(file: h5py.File) -> None:
    file["motions/2/coefficients"][0, 0] = np.nan


def _flatten_coefficients(file: h5py.File) -> None:
    flat = file["motions/2/coefficients"][()].ravel()
    del file["motions/2/coefficients"]
    file["motions/2/coefficients"] = flat


def _number_motions(file: h5py.File) -> None:
    del file["motions"]
    file["motions"] = np.zeros(3)


DAMAGE: dict[str, Callable[[h5py.File], None]] = {
    "no schema": lambda file: file.attrs.__delitem__("schema"),
    "no config": lambda file: file.attrs.__delitem__("config"),
    "schema in words": lambda file: file.attrs.__setitem__("schema", "new"),
    "versions are no JSON": lambda file: file.attrs.__setitem__("versions", "{"),
    "no stack": lambda file: file.__delitem__("stack"),
    "no rows": lambda file: file["stack"].attrs.__delitem__("rows"),
    "no base parameters": lambda file: file.__delitem__("base_parameters"),
    "no coefficients": lambda file: file["motions/1"].__delitem__("coefficients"),
    "coefficients not finite": _spoil_coefficients,
    "coefficients flat": _flatten_coefficients,
    "no status": lambda file: file["motions/1"].attrs.__delitem__("status"),
    "margins are a list": lambda file: file["motions/1"].attrs.__setitem__("margins", "[1]"),
    "margins of another kind": lambda file: file["motions/1"].attrs.__setitem__(
        "margins", '{"torque": {"size": 1}}'
    ),
    "a motion called one": lambda file: file.move("motions/1", "motions/one"),
    "a motion is missing": lambda file: file.__delitem__("motions/1"),
    "motions are numbers": _number_motions,
    "random coefficients missing": lambda file: file["random/1"].__delitem__("coefficients"),
    "no candidates": lambda file: file.attrs.__setitem__("random_candidates", np.zeros(0)),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_missing_and_misshapen_parts(copy: Path, damage: str) -> None:
    with h5py.File(copy, "a") as file:
        DAMAGE[damage](file)
    message = refused(copy)
    assert "is damaged" in message
    assert len(message) < 500


def test_an_unharmed_copy_is_read(copy: Path) -> None:
    """The tests above fail for what they change, not for being copies."""
    assert read_result(copy).motions


@pytest.mark.parametrize("structure", [b"TREE", b"SNOD", b"HEAP", b"GCOL"])
def test_bytes_lost_on_the_disk_give_a_result_or_a_message(
    stored: Stored, tmp_path: Path, structure: bytes
) -> None:
    """The file opens, but its inner structures are broken one after the other."""
    content = stored.path.read_bytes()
    path = tmp_path / "flipped.h5"
    messages = []
    for place in re.finditer(structure, content):
        flipped = bytearray(content)
        for position in range(place.start() + 4, place.start() + 40):
            flipped[position] ^= 0xFF
        path.write_bytes(flipped)
        try:
            read_result(path)
        except FileError as error:
            messages.append(str(error))
    assert messages
    assert all(str(path) in message for message in messages)

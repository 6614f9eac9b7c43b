"""Files of ours that someone edited: every part spoiled one at a time, through every command.

Every mutant is read by the library; those that it takes go through the commands that read them.
"""

import itertools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from excite_cli.errors import ExciteError
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.fit_file import read_fit
from excite_cli.store.result_file import read_result
from tests.store.mutations import mutations
from tests.trust.conftest import SMOKE, Edit, Loop, config_with, edited
from tests.trust.in_process import excite, refused

READERS: dict[str, Callable[[Path], object]] = {
    "result": read_result,
    "fit": read_fit,
    "diagnosis": read_diagnosis,
}
EVERY = 12  # mutant; the others are left to longer runs
COMMANDS_FOR = 6  # mutants that the reader takes
BRIEF = ("--motions", "1", "--set", "optimizer.max_iterations=1", "-q", "--overwrite")


def commands(kind: str, file: Path) -> Iterator[list[str | Path]]:
    """All that read such a file, as briefly as they can."""
    folder, quiet = file.parent, ("-q", "--overwrite")
    planned = folder / "planned.h5"
    if kind == "result":
        shutil.copy(file, folder / "resumed.h5")
        yield ["check", SMOKE, file, "--no-meshes", "--rate", "20", "-q"]
        yield ["export", file, "-f", "csv", "--rate", "20", "-o", folder / "m.csv", *quiet]
        yield ["optimize", SMOKE, "--prior", file, "-o", planned, *BRIEF]
        yield ["optimize", SMOKE, "--start", file, "-o", planned, *BRIEF]
        yield ["optimize", SMOKE, "-o", folder / "resumed.h5", "--resume", *BRIEF[:-1]]
        yield [
            "compare-random", SMOKE, "--optimized", file, "--candidates", "2", "--seconds", "0",
            "-q",
        ]  # fmt: skip
        yield ["simulate", SMOKE, file, "-o", folder / "data.h5", "--rate", "50", *quiet]
        yield ["identify", SMOKE, file, "-q"]
        yield ["study", SMOKE, file, "--identify-only", "-o", folder / "study", *quiet]
    if kind == "fit":
        for form in ("urdf", "mjcf", "yaml"):
            yield ["export", file, "-f", form, "-o", folder / f"model.{form}", *quiet]
        yield ["optimize", SMOKE, "--set", f"uncertainty.fit={file}", "-o", planned, *BRIEF]
    if kind == "diagnosis":
        yield ["optimize", SMOKE, "--after", file, "-o", planned, *BRIEF]
    yield ["report", file, "--no-picture", "-o", folder / "page.html", *quiet]


@pytest.mark.parametrize("kind", READERS)
def test_spoiled_parts_give_a_sentence(kind: str, loop: Loop, tmp_path: Path) -> None:
    source, file = loop.folder / f"{kind}.h5", tmp_path / "edited.h5"
    taken: list[str] = []
    told: list[str] = []
    for mutation in itertools.islice(mutations(source), 0, None, EVERY):
        mutation.apply(source, file)
        try:
            READERS[kind](file)
        except ExciteError as error:
            told.append(str(error))
        else:
            taken.append(mutation.name)
    assert taken
    assert all(str(file) in each for each in told)
    step = max(1, len(taken) // COMMANDS_FOR)
    chosen = set(taken[::step])
    ended: list[int] = []
    for mutation in mutations(source):
        if mutation.name not in chosen:
            continue
        mutation.apply(source, file)
        turn = list(commands(kind, file))
        run = excite(*turn[len(ended) % len(turn)])
        assert run.returncode in (0, 1, 2), (mutation.name, run)
        ended.append(run.returncode)
    assert ended


def test_a_config_that_disagrees_with_the_coefficients(loop: Loop, tmp_path: Path) -> None:
    file = edited(loop.result, tmp_path / "r.h5", config_with("harmonics: 4", "harmonics: 5"))
    for arguments in itertools.islice(commands("result", file), 5):
        told = refused(*(each for each in arguments if each != "-q"))
        assert "/motions/1/coefficients has the shape 9 x 5 instead of 11 x 5" in told


def _cut(name: str, *size: slice) -> Edit:
    """Leaves a part of an array."""

    def edit(file: Any) -> None:
        part = file[name][size]
        del file[name]
        file[name] = part

    return edit


@pytest.mark.parametrize("size", [1, 25])
def test_a_small_factor(loop: Loop, tmp_path: Path, size: int) -> None:
    file = edited(loop.result, tmp_path / "r.h5", _cut("stack/R", slice(size), slice(size)))
    told = refused("optimize", SMOKE, "--prior", file, "-o", tmp_path / "new.h5")
    assert f"/stack/R has the shape {size} x {size} instead of 26 x 26" in told


def _shifted(file: Any) -> None:
    file["motions/1/coefficients"][0, 0] += 0.1


OTHERS = "are not those of its coefficients and config"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (config_with("base_frequency: 1.04", "base_frequency: 2.04"), OTHERS),
        (_shifted, OTHERS),
        (_cut("motions/1/q", slice(None), slice(4)), "has the shape 121 x 4 instead of 121 x 5"),
        (config_with("joints: all", "joints: [shoulder_yaw, elbow]"),
         "but its config names shoulder_yaw, elbow"),
    ],
)  # fmt: skip
def test_export_of_what_its_samples_do_not_say(
    loop: Loop, tmp_path: Path, change: Edit, words: str
) -> None:
    """Whoever edits a config would send another motion to the robot than was checked."""
    file = edited(loop.result, tmp_path / "r.h5", change)
    assert words in refused("export", file, "-f", "csv", "-o", tmp_path / "m.csv")
    assert not (tmp_path / "m.csv").exists()


@pytest.mark.parametrize(
    ("no_links", "words"),
    [
        (False, "'links' are not those of its bodies"),
        (True, "parameters of other joints or bodies"),
    ],
)
def test_export_of_a_fit_of_other_bodies(
    loop: Loop, tmp_path: Path, no_links: bool, words: str
) -> None:
    def change(file: Any) -> None:
        for name in ("fit/phi", "fit/consistent/phi"):
            _cut(name, slice(-10))(file)
        if no_links:
            del file["fit/records/links"]

    file = edited(loop.fit, tmp_path / "f.h5", change)
    assert words in refused("export", file, "-f", "urdf", "-o", tmp_path / "m.urdf")


@pytest.mark.parametrize(
    ("kind", "form"), [("result", "urdf"), ("fit", "csv"), ("diagnosis", "csv")]
)
def test_export_in_a_form_that_the_file_cannot_give(
    loop: Loop, tmp_path: Path, kind: str, form: str
) -> None:
    refused("export", loop.folder / f"{kind}.h5", "-f", form, "-o", tmp_path / f"m.{form}")

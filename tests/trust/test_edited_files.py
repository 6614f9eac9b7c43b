"""Files of ours that someone edited: every part spoiled one at a time, through every command.

Every mutant is read by the library; those that it takes go through the commands that read them.
"""

import itertools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import pytest

from excite_cli.errors import ExciteError
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.fit_file import read_fit
from excite_cli.store.result_file import read_result
from tests.store.mutations import mutations
from tests.trust.conftest import SMOKE, Loop
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
        ended.append(_sound(mutation.name, turn[len(ended) % len(turn)]))
    assert ended


def _sound(name: str, arguments: list[str | Path]) -> int:
    run = excite(*arguments)
    assert run.returncode in (0, 1, 2), (name, arguments, run.stderr)
    return run.returncode


def edited(source: Path, target: Path, change: Callable[[h5py.File], None]) -> Path:
    shutil.copy(source, target)
    with h5py.File(target, "r+") as file:
        change(file)
    return target


def config_with(old: str, new: str) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        text = file.attrs["config"]
        assert old in text
        file.attrs["config"] = text.replace(old, new)

    return change


def test_a_config_that_disagrees_with_the_coefficients(loop: Loop, tmp_path: Path) -> None:
    file = edited(loop.result, tmp_path / "r.h5", config_with("harmonics: 4", "harmonics: 5"))
    for arguments in itertools.islice(commands("result", file), 5):
        told = refused(*(each for each in arguments if each != "-q"))
        assert "/motions/1/coefficients has the shape 9 x 5 instead of 11 x 5" in told


@pytest.mark.parametrize("size", [1, 25])
def test_a_small_factor(loop: Loop, tmp_path: Path, size: int) -> None:
    def change(file: h5py.File) -> None:
        factor = file["stack/R"][:size, :size]
        del file["stack/R"]
        file["stack/R"] = factor

    file = edited(loop.result, tmp_path / "r.h5", change)
    told = refused("optimize", SMOKE, "--prior", file, "-o", tmp_path / "new.h5")
    assert f"/stack/R has the shape {size} x {size} instead of 26 x 26" in told


def _faster(file: h5py.File) -> None:
    config_with("base_frequency: 1.04", "base_frequency: 2.04")(file)


def _shifted(file: h5py.File) -> None:
    file["motions/1/coefficients"][0, 0] += 0.1


def _cut(file: h5py.File) -> None:
    samples = file["motions/1/q"][:, :4]
    del file["motions/1/q"]
    file["motions/1/q"] = samples


OTHERS = "are not those of its coefficients and config"


@pytest.mark.parametrize(
    ("change", "words"),
    [(_faster, OTHERS), (_shifted, OTHERS), (_cut, "has the shape 121 x 4 instead of 121 x 5")],
)
def test_export_of_what_its_samples_do_not_say(
    loop: Loop, tmp_path: Path, change: Callable[[h5py.File], None], words: str
) -> None:
    """Whoever edits a config would send another motion to the robot than was checked."""
    file = edited(loop.result, tmp_path / "r.h5", change)
    told = refused("export", file, "-f", "csv", "-o", tmp_path / "m.csv")
    assert words in told
    assert not (tmp_path / "m.csv").exists()


def test_export_of_other_joints_than_the_config_names(loop: Loop, tmp_path: Path) -> None:
    change = config_with("joints: all", "joints: [shoulder_yaw, elbow]")
    file = edited(loop.result, tmp_path / "r.h5", change)
    told = refused("export", file, "-f", "csv", "-o", tmp_path / "m.csv")
    assert "but its config names shoulder_yaw, elbow" in told


def test_export_of_a_fit_of_other_bodies(loop: Loop, tmp_path: Path) -> None:
    def change(file: h5py.File) -> None:
        for name in ("fit/phi", "fit/consistent/phi"):
            values = file[name][:-10]
            del file[name]
            file[name] = values

    file = edited(loop.fit, tmp_path / "f.h5", change)
    told = refused("export", file, "-f", "urdf", "-o", tmp_path / "m.urdf")
    assert "'links' are not those of its bodies" in told

    def without_links(file: h5py.File) -> None:
        change(file)
        del file["fit/records/links"]

    file = edited(loop.fit, tmp_path / "g.h5", without_links)
    told = refused("export", file, "-f", "urdf", "-o", tmp_path / "m.urdf")
    assert "parameters of other joints or bodies" in told


@pytest.mark.parametrize(
    ("kind", "form"), [("result", "urdf"), ("fit", "csv"), ("diagnosis", "csv")]
)
def test_export_in_a_form_that_the_file_cannot_give(
    loop: Loop, tmp_path: Path, kind: str, form: str
) -> None:
    refused("export", loop.folder / f"{kind}.h5", "-f", form, "-o", tmp_path / f"m.{form}")

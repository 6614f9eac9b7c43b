"""No result replaces what it is made from, whatever its name is spelt like."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import excite_cli as api
from excite_cli.errors import FileError
from excite_cli.given_files import refuse_inputs_as_outputs
from tests.trust.conftest import SMOKE, Loop
from tests.trust.in_process import refused


@pytest.fixture
def folder(loop: Loop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current one, with copies that a bad command could spoil: the URDF too."""
    for path in (loop.result, loop.data, loop.fit, loop.diagnosis):
        shutil.copy(path, tmp_path / path.name)
    shutil.copy(SMOKE.parent.parent / "data" / "smoke_arm.urdf", tmp_path / "arm.urdf")
    text = SMOKE.read_text().replace("../data/smoke_arm.urdf", "arm.urdf")
    (tmp_path / "arm.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir()) if p.is_file()}


FIT = "uncertainty.fit=fit.h5"
COMMANDS = [
    "optimize arm.yaml -o arm.yaml",
    "optimize arm.yaml -o arm.urdf",
    f"optimize arm.yaml -o fit.h5 --set {FIT}",
    "optimize arm.yaml --prior data.h5 -o data.h5",
    "optimize arm.yaml --start result.h5 -o result.h5",
    "optimize arm.yaml --after diagnosis.h5 -o diagnosis.h5",
    "compare-random arm.yaml -o arm.yaml",
    "compare-random arm.yaml -o arm.urdf",
    "compare-random arm.yaml --optimized result.h5 -o result.h5",
    "simulate arm.yaml result.h5 -o result.h5",
    "simulate arm.yaml result.h5 -o arm.urdf",
    "identify arm.yaml data.h5 -o data.h5",
    "identify arm.yaml data.h5 --urdf arm.urdf",
    "identify arm.yaml data.h5 --mjcf data.h5",
    "identify arm.yaml data.h5 --parameters arm.yaml",
    "diagnose arm.yaml data.h5 -o data.h5",
    "diagnose arm.yaml data.h5 --apply arm.yaml",
    "diagnose arm.yaml data.h5 --apply arm.urdf",
    "export result.h5 -f csv --motion 1 -o result.h5",
    "export fit.h5 -f urdf -o fit.h5",
    "init --urdf arm.urdf -o arm.urdf",
    # These ask for a suffix: a result of that name is still an input.
    "report page.html -o ./page.html",
    "view picture.png --png ./picture.png",
    # A study whose case is its log.
    "study arm.yaml data.h5 data_seed=1.fit.h5 --vary seed=1 -o .",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_replaces_its_inputs(folder: Path, command: str) -> None:
    for name in ("page.html", "picture.png"):
        shutil.copy("result.h5", name)
    shutil.copy("data.h5", "data_seed=1.fit.h5")
    before = contents(folder)
    told = refused(*command.split(), "--overwrite")
    assert "would replace" in told
    assert "Results never replace what they are made from: give another name." in told
    assert contents(folder) == before


def _linked(path: Path) -> Path:
    link = path.with_name("other.h5")
    link.symlink_to(path)
    return link


def _hard_linked(path: Path) -> Path:
    link = path.with_name("other.h5")
    os.link(path, link)
    return link


def _roundabout(path: Path) -> Path:
    return Path("..") / path.parent.name / "." / path.name


@pytest.mark.parametrize("spelt", [_linked, _hard_linked, _roundabout])
@pytest.mark.parametrize("turned", [False, True])
def test_other_spellings_are_the_same_file(
    folder: Path, spelt: Callable[[Path], Path], turned: bool
) -> None:
    output, given = spelt(folder / "data.h5"), folder / "data.h5"
    if turned:
        output, given = given, output
    told = refused("identify", "arm.yaml", given, "-o", output, "--overwrite")
    assert f"--output {output} would replace {given}" in told


def test_folders_that_hold_inputs(tmp_path: Path) -> None:
    bag, log = tmp_path / "bag", tmp_path / "bag" / "log.mcap"
    bag.mkdir()
    log.touch()
    for output, given in ((bag, log), (log, bag), (bag, bag)):
        with pytest.raises(FileError, match="would replace"):
            refuse_inputs_as_outputs({"output": output}, (given,))
    refuse_inputs_as_outputs({"output": bag / "new.h5", "none": None}, (log, bag))


def test_functions_that_no_command_calls_so_refuse_too(folder: Path) -> None:
    case = api.load_case(folder / "arm.yaml")
    data = api.load_data(case, folder / "data.h5")
    found, fitted = api.read_diagnosis(folder / "diagnosis.h5"), api.identify(case, data)
    urdf = folder / "arm.urdf"
    calls: list[Callable[[], object]] = [
        lambda: api.simulate(
            case, folder / "result.h5", output=folder / "arm.yaml", overwrite=True
        ),
        lambda: api.write_dataset(folder / "data.h5", data, {}),
        lambda: api.save_config(urdf, case, found),
        lambda: api.save_fit(urdf, case, fitted),
    ]
    before = contents(folder)
    for call in calls:
        with pytest.raises(FileError, match="would replace"):
            call()
    assert contents(folder) == before

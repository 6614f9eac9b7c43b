"""No result replaces what it is made from, whatever its name is spelt like."""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

import excite_cli as api
from excite_cli.errors import FileError
from excite_cli.given_files import refuse_inputs_as_outputs
from tests.trust.conftest import SMOKE, Loop
from tests.trust.in_process import refused


@dataclass(frozen=True)
class Files:
    """Copies that a bad command could spoil: all in one folder, the URDF too."""

    folder: Path
    config: Path
    urdf: Path
    result: Path
    data: Path
    fit: Path
    diagnosis: Path

    def contents(self) -> dict[str, bytes]:
        return {p.name: p.read_bytes() for p in sorted(self.folder.iterdir()) if p.is_file()}


@pytest.fixture
def files(loop: Loop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Files:
    for path in (loop.result, loop.data, loop.fit, loop.diagnosis):
        shutil.copy(path, tmp_path / path.name)
    shutil.copy(SMOKE.parent.parent / "data" / "smoke_arm.urdf", tmp_path / "arm.urdf")
    config = tmp_path / "arm.yaml"
    config.write_text(SMOKE.read_text().replace("../data/smoke_arm.urdf", "arm.urdf"))
    monkeypatch.chdir(tmp_path)
    names = ("result", "data", "fit", "diagnosis")
    return Files(tmp_path, config, tmp_path / "arm.urdf", *(tmp_path / f"{n}.h5" for n in names))


Command = Callable[[Files], list[str | Path]]
FIT = "uncertainty.fit=fit.h5"
COMMANDS: dict[str, Command] = {
    "optimize on its config": lambda f: ["optimize", f.config, "-o", f.config],
    "optimize on its URDF": lambda f: ["optimize", f.config, "-o", f.urdf],
    "optimize on its fit": lambda f: ["optimize", f.config, "-o", f.fit, "--set", FIT],
    "optimize on --prior": lambda f: ["optimize", f.config, "--prior", f.data, "-o", f.data],
    "optimize on --start": lambda f: ["optimize", f.config, "--start", f.result, "-o", f.result],
    "optimize on --after": lambda f: [
        "optimize", f.config, "--after", f.diagnosis, "-o", f.diagnosis
    ],
    "compare-random on its config": lambda f: ["compare-random", f.config, "-o", f.config],
    "compare-random on its URDF": lambda f: ["compare-random", f.config, "-o", f.urdf],
    "compare-random on --optimized": lambda f: [
        "compare-random", f.config, "--optimized", f.result, "-o", f.result
    ],
    "simulate on its motions": lambda f: ["simulate", f.config, f.result, "-o", f.result],
    "simulate on its URDF": lambda f: ["simulate", f.config, f.result, "-o", f.urdf],
    "identify on its data": lambda f: ["identify", f.config, f.data, "-o", f.data],
    "identify --urdf on the URDF": lambda f: ["identify", f.config, f.data, "--urdf", f.urdf],
    "identify --mjcf on its data": lambda f: ["identify", f.config, f.data, "--mjcf", f.data],
    "identify --parameters on its config": lambda f: [
        "identify", f.config, f.data, "--parameters", f.config
    ],
    "diagnose on its data": lambda f: ["diagnose", f.config, f.data, "-o", f.data],
    "diagnose --apply on its config": lambda f: [
        "diagnose", f.config, f.data, "--apply", f.config
    ],
    "diagnose --apply on its URDF": lambda f: ["diagnose", f.config, f.data, "--apply", f.urdf],
    "export of motions": lambda f: [
        "export", f.result, "-f", "csv", "--motion", "1", "-o", f.result
    ],
    "export of a fit": lambda f: ["export", f.fit, "-f", "urdf", "-o", f.fit],
    "init on its URDF": lambda f: ["init", "--urdf", f.urdf, "-o", f.urdf],
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_no_command_replaces_its_inputs(files: Files, name: str) -> None:
    before = files.contents()
    told = refused(*COMMANDS[name](files), "--overwrite")
    assert "Results never replace what they are made from: give another name." in told
    assert files.contents() == before


@pytest.mark.parametrize("command", ["report", "view"])
def test_pages_and_pictures_that_are_inputs(files: Files, command: str) -> None:
    """They ask for a suffix: a result of that name is still an input."""
    name, option = {"report": ("page.html", "-o"), "view": ("picture.png", "--png")}[command]
    shutil.copy(files.result, name)
    before = files.contents()
    assert "would replace" in refused(command, name, option, f"./{name}", "--overwrite")
    assert files.contents() == before


def test_a_study_whose_case_is_its_log(files: Files) -> None:
    log = Path("data_seed=1.fit.h5")
    shutil.copy(files.data, log)
    before = files.contents()
    told = refused(
        "study", files.config, files.data, log, "--vary", "seed=1", "-o", ".", "--overwrite"
    )
    assert "would replace" in told
    assert files.contents() == before


def _linked(files: Files) -> Path:
    link = files.folder / "other.h5"
    link.symlink_to(files.data)
    return link


def _hard_linked(files: Files) -> Path:
    link = files.folder / "other.h5"
    os.link(files.data, link)
    return link


def _roundabout(files: Files) -> Path:
    return Path("..") / files.folder.name / "." / "data.h5"


@pytest.mark.parametrize("spelt", [_linked, _hard_linked, _roundabout])
@pytest.mark.parametrize("turned", [False, True])
def test_other_spellings_are_the_same_file(
    files: Files, spelt: Callable[[Files], Path], turned: bool
) -> None:
    output, given = spelt(files), files.data
    if turned:
        output, given = given, output
    told = refused("identify", files.config, given, "-o", output, "--overwrite")
    assert f"--output {output} would replace {given}" in told


def test_folders_that_hold_inputs(tmp_path: Path) -> None:
    bag, log = tmp_path / "bag", tmp_path / "bag" / "log.mcap"
    bag.mkdir()
    log.touch()
    for output, given in ((bag, log), (log, bag), (bag, bag)):
        with pytest.raises(FileError, match="would replace"):
            refuse_inputs_as_outputs({"output": output}, (given,))
    refuse_inputs_as_outputs({"output": bag / "new.h5", "none": None}, (log, bag))


def test_the_library_refuses_too(files: Files) -> None:
    problem = api.load_problem(files.config, ["optimizer.max_iterations=1", FIT])
    data, case = api.load_data(problem, files.data), api.load_case(files.config)
    following = api.plan_after(case, files.diagnosis)
    found, fit = api.read_diagnosis(files.diagnosis), api.identify(case, data)
    calls: list[Callable[[], object]] = [
        lambda: api.plan(problem, output=files.urdf, overwrite=True),
        lambda: api.plan(problem, output=files.config, overwrite=True),
        lambda: api.plan(following, output=files.config, overwrite=True),
        lambda: api.diagnose(case, data, apply=files.config, overwrite=True),
        lambda: api.simulate(case, files.result, output=files.config, overwrite=True),
        lambda: api.plan(problem, output=str(files.fit), overwrite=True),
        lambda: api.plan(problem, priors=[files.result], output=files.result, overwrite=True),
        lambda: api.diagnose(problem, data, output=files.data),
        lambda: api.save_config(files.urdf, problem, found),
        lambda: api.save_fit(files.urdf, problem, fit),
    ]
    before = files.contents()
    for call in calls:
        with pytest.raises(FileError, match="would replace"):
            call()
    assert files.contents() == before

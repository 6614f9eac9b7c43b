"""What the robot carries, beside a fit of the robot alone; data from MuJoCo, by the user's path."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli import (
    identify,
    identify_load,
    load_case,
    plan,
    plan_load,
    save_fit,
    write_dataset,
)
from excite_cli.api.load_planning import LoadProblem
from excite_cli.api.loading import Case
from excite_cli.config.data_spec import EffectSpec
from excite_cli.errors import ConfigError, FileError
from excite_cli.identification.carried_load import expected_load
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement.dataset import Dataset
from excite_cli.store.fit_file import read_fit
from excite_cli.summary.identification import load_answer
from tests.cli.program import SMOKE, Program

pytest.importorskip("mujoco")

from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.diagnosis.simulated_arm import ROBOT, SLIDE, PlantedEffect, planted, played

MASS, CENTRE = 1.8, (0.03, -0.02, 0.06)
DECLARED = "effects: [{kind: viscous_friction}, {kind: coulomb_friction}]\n"


def loaded_arm(*runs: int) -> list[PlantedEffect]:
    """Friction of all joints, and the load in some runs."""
    kinds = ("viscous_friction", "coulomb_friction")
    friction = [planted(kind, j, 1.0) for kind in kinds for j in range(ROBOT.n)]
    centre = dict(zip(("cx", "cy", "cz"), CENTRE, strict=True))
    return [*friction, planted("payload", SLIDE, MASS, *runs, **centre)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("load")
    (path / "arm.yaml").write_text(
        SMOKE.read_text().replace("../data/", f"{SMOKE.parents[1]}/data/") + DECLARED
    )
    return path


@pytest.fixture(scope="module")
def case(folder: Path) -> Case:
    return load_case(folder / "arm.yaml")


@pytest.fixture(scope="module")
def runs() -> Dataset:
    """Four without a load, one with it."""
    return played(loaded_arm(5), range(1, 6), 4.0)


@pytest.fixture(scope="module")
def fit(folder: Path, case: Case, runs: Dataset) -> Path:
    alone = replace(runs, runs=runs.runs[:4])
    save_fit(folder / "fit.h5", case, identify(case, alone))
    return folder / "fit.h5"


@pytest.fixture(scope="module")
def loaded(runs: Dataset) -> Dataset:
    return replace(runs, runs=runs.runs[4:])


@pytest.mark.long
def test_mass_centre_and_inertia(case: Case, loaded: Dataset, fit: Path) -> None:
    found = identify_load(case, loaded, fit)
    assert (found.link, found.joint, found.possible) == ("tool", "slide", True)
    told = found.parameters
    assert told["mass"].value == pytest.approx(MASS, rel=0.01)
    inertia = 0.4 * MASS * 0.05**2  # of the sphere
    truth = {
        "mass": MASS,
        **dict(zip(("cx", "cy", "cz"), CENTRE, strict=True)),
        **dict.fromkeys(("Ixx", "Iyy", "Izz"), inertia),
        **dict.fromkeys(("Ixy", "Ixz", "Iyz"), 0.0),
    }
    for name, value in truth.items():
        assert abs(told[name].value - value) < 4.0 * told[name].std, name
    assert [told[name].value for name in ("cx", "cy", "cz")] == pytest.approx(CENTRE, abs=3e-3)
    assert found.with_load.mean_relative_moving < 0.3 * found.without.mean_relative_moving
    assert found.findings == (), "a heavy load is no fault of the columns"
    # The load is no surer than the robot nor than its model. However little noise: a thousandth of
    # the mass, a tenth of a millimetre.
    stored = read_fit(fit)
    quiet, sure, vague = (
        identify_load(
            case,
            loaded,
            replace(stored, fit=replace(stored.fit, covariance=k * stored.fit.covariance)),
        ).parameters
        for k in (1e-8, 1.0, 1e4)
    )
    for name in ("mass", "cx", "cy", "cz"):
        assert vague[name].std > 1.2 * sure[name].std
    assert quiet["mass"].std >= 1e-3 * quiet["mass"].value
    assert min(quiet[name].std for name in ("cx", "cy", "cz")) >= 1e-4


def test_the_load_as_a_controller_reads_it(
    case: Case, loaded: Dataset, fit: Path, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match="links named …tool0"):
        identify_load(case, loaded, fit, ur=tmp_path / "load.script")
    identify_load(case, loaded, fit, "tool", ur=tmp_path / "a.script", franka=tmp_path / "a.json")
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["mass"] == pytest.approx(MASS, rel=0.01)
    assert told["centerOfMass"] == pytest.approx(CENTRE, abs=3e-3)
    begin = f"set_target_payload({told['mass']}, [{told['centerOfMass'][0]}, "
    assert (tmp_path / "a.script").read_text().startswith(begin)
    with pytest.raises(FileError, match="exists already"):
        identify_load(case, loaded, fit, "tool", ur=tmp_path / "a.script")


def test_nothing_carried_is_told_as_nothing_and_a_changed_robot_as_that(
    case: Case, runs: Dataset, fit: Path, loaded: Dataset
) -> None:
    found = identify_load(case, replace(runs, runs=runs.runs[3:4]), fit)
    mass = found.parameters["mass"]
    assert abs(mass.value) < 4.0 * mass.std
    assert mass.std < 0.02
    # A robot that changed is told.
    last = loaded.runs[0]
    rubbing = replace(last, tau=last.tau + 8.0 * np.sign(last.q - last.q.mean(axis=0)))
    found = identify_load(case, replace(loaded, runs=(rubbing,)), fit)
    assert "more_than_a_load" in {finding.kind for finding in found.findings}
    assert "more than a rigid payload" in str(load_answer(found).parts[0])


def test_gains_that_nobody_told_are_in_the_load(case: Case, runs: Dataset, loaded: Dataset) -> None:
    """A run with an unknown payload ties the gains of the joints together, not to the truth."""
    more = case.spec.effects or ()
    carries = EffectSpec(kind="payload", runs=("r5",))
    assumed = case.spec.identification.model_copy(update={"gain_std": 0.1})
    spec = case.spec.model_copy(update={"effects": (*more, carries), "identification": assumed})
    loose = replace(case, spec=spec)
    found = identify(loose, runs, held_out="r4")
    stored = StoredFit(
        "", "", case.robot.fingerprint(), found.fit, found.held_out_run, found.error,
        found.training_error, (), (), processing=found.processing.as_data(),
    )  # fmt: skip
    mass = identify_load(loose, loaded, stored).parameters["mass"]
    assert 0.07 * MASS < mass.std < 0.15 * MASS
    assert abs(mass.value - MASS) < 2.0 * mass.std


@pytest.fixture(scope="module")
def planned(case: Case, fit: Path) -> LoadProblem:
    return plan_load(case, fit, seconds=(3.0, 5.0))


@pytest.mark.long
def test_the_planned_motion_tells_a_load_as_well_as_expected(
    case: Case, runs: Dataset, fit: Path, planned: LoadProblem
) -> None:
    (step,) = plan(planned.problem).motions
    assert all(step.certified.values())
    motion_of_load = PlannedMotion("load", planned.problem.trajectory, step.coefficients)
    settings = SimulationSettings(rate=200.0, lead_in=0.5)
    data = simulate(ROBOT, [motion_of_load], settings, loaded_arm()).dataset
    told = identify_load(case, data, fit).parameters
    assert told["mass"].value == pytest.approx(MASS, rel=0.01)
    centre = [told[name].value for name in ("cx", "cy", "cz")]
    assert np.linalg.norm(np.subtract(centre, CENTRE)) < 3e-3
    assert 0.3 < told["mass"].std / planned.expected.mass_std < 3.0
    # The problem of the load still has the robot's parameters.
    alone = replace(runs, runs=runs.runs[:4])
    assert planned.problem.base.rank == 10 < case.base.rank
    assert identify(planned.problem, alone).fit.rank == case.base.rank
    same = identify_load(planned.problem, replace(runs, runs=runs.runs[4:]), fit)
    assert same.parameters["mass"].value == pytest.approx(MASS, rel=0.01)


def test_what_is_expected_shrinks_with_time(case: Case, fit: Path, planned: LoadProblem) -> None:
    stored = read_fit(fit)
    (step,) = plan(planned.problem).motions
    trajectory = planned.problem.trajectory
    expected = []
    for rate in (20.0, 80.0):  # four times as many samples
        t = np.arange(0.0, trajectory.duration, 1.0 / rate)
        states = trajectory.states(t, step.coefficients)
        expected.append(expected_load(case.robot, case.base, stored, None, (t, *states)))
    ratio = expected[0].center_std / expected[1].center_std
    assert 1.3 < ratio < 2.1  # two, less what the fit itself does not know


@pytest.mark.long
def test_the_commands(folder: Path, case: Case, loaded: Dataset, fit: Path) -> None:
    program = Program(folder, folder / "cache")
    write_dataset(folder / "loaded.h5", loaded)
    answer: Any = program.answer(
        "identify", "arm.yaml", "loaded.h5", "--only", "payload", "--fit", fit.name
    )
    assert answer["link"] == "tool"
    assert answer["parameters"]["mass"]["value"] == pytest.approx(MASS, rel=0.01)
    shown = program("identify", "arm.yaml", "loaded.h5", "--only", "payload", "--fit", fit.name)
    assert shown.returncode == 0
    assert shown.stdout.startswith("tool carries 1.")
    answer = program.answer(
        "optimize", "arm.yaml", "--for", "payload", "--fit", fit.name, "-o", "load.h5"
    )
    assert answer["motions"][0]["condition_number"] < 10.0
    assert program("check", "load.yaml", "load.h5").returncode == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("identify", "arm.yaml", "x.h5", "--only", "payload"), "needs --fit"),
        (("identify", "arm.yaml", "x.h5", "--fit", "fit.h5"), "belong to --only payload"),
        (
            ("identify", "arm.yaml", "x.h5", "--only", "payload", "--fit", "fit.h5", "-o", "y.h5"),
            "takes no -o",
        ),
        (("optimize", "arm.yaml", "--for", "payload"), "needs --fit"),
        (("optimize", "arm.yaml", "--link", "tool"), "belong to --for payload"),
        (
            ("optimize", "arm.yaml", "--for", "payload", "--fit", "fit.h5"),
            "beside the result, as arm.yaml, which is read here. Give another name, as -o load.h5",
        ),
        (
            ("optimize", "arm.yaml", "--for", "payload", "--fit", "fit.h5", "-o", "x.yaml"),
            "as x.yaml, which is the result itself",
        ),
        (
            ("optimize", "arm.yaml", "--for", "payload", "--fit", "fit.h5", "--motions", "2"),
            "leave --motions out",
        ),
        (
            ("optimize", "arm.yaml", "--after", "x.h5", "--set", "criterion.of=load"),
            "give the config that was diagnosed",
        ),
        (
            ("optimize", "arm.yaml", "--for", "payload", "--fit", "fit.h5", "--prior", "x.h5"),
            "takes no --after, --prior",
        ),
    ],
)
def test_options_that_do_not_go_together(
    folder: Path, words: tuple[str, ...], message: str
) -> None:
    run = Program(folder, folder / "cache")(*words)
    assert run.returncode == 2
    assert message in " ".join(run.stderr.split())


def test_errors(case: Case, loaded: Dataset, fit: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"--link: the robot has no link 'tol'"):
        identify_load(case, loaded, fit, "tol")
    with pytest.raises(ConfigError, match=r"--link: these data do not show all ten.*column"):
        identify_load(case, loaded, fit, "column")
    other = replace(read_fit(fit), fingerprint="another")
    with pytest.raises(FileError, match=r"--fit: it was made for another robot"):
        identify_load(case, loaded, other)
    with pytest.raises(FileError, match=r"--fit: it was made for another robot"):
        plan_load(case, other)
    with pytest.raises(ConfigError, match=r"--link: the robot has no link 'tol'"):
        plan_load(case, fit, "tol")
    with pytest.raises(ConfigError, match="no motion of these joints shows all ten"):
        plan_load(case, fit, "column")

"""Delay and gains of drives found in the log of a MuJoCo robot that reports positions alone."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from excite_cli import identify, load_case
from excite_cli.api.drive_law import with_drive_law
from excite_cli.api.loading import Case, load_data
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.drive_law import FoundLaw, find_law, is_sought
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.torque import with_torques
from excite_cli.measurement.torque_sources.command import DriveLaw
from excite_cli.shown.note import Note
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.position_drive import PositionDrive
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from tests.simulation.arms import arm, motion

pytest.importorskip("mujoco")
KP, KD = (3000.0, 3000.0, 2000.0, 900.0, 900.0, 600.0), (200.0, 200.0, 100.0, 20.0, 20.0, 8.0)
FRICTION = [{"kind": kind} for kind in ("viscous_friction", "coulomb_friction", "armature")]


@cache
def followed(delay: float = 0.009, rate: float = 250.0, limit: float | None = None) -> Dataset:
    """Three motions of an arm whose drives follow set points, its encoders coarse.

    `limit` [N·m]: where the drive of the second joint saturates.
    """
    robot = arm()
    drive = PositionDrive(KP, KD, rate, delay)
    settings = SimulationSettings(rate=rate, encoder=3e-4, inertia_error=0.1, drive=drive)
    sizes = {"viscous_friction": 8.0, "coulomb_friction": 4.0, "armature": 0.5}
    effects = [
        plant(kind_named(kind), (j,), size, {}) for kind, size in sizes.items()
        for j in range(robot.n)
    ]  # fmt: skip
    if limit is not None:
        stuck = plant(kind_named("torque_saturation"), (1,), limit, {"actuator": 1.0})
        effects.append(stuck)
    motions = [motion(robot, seed, f"motion_{seed}") for seed in (1, 2, 3)]
    return simulate(robot, motions, settings, effects).dataset


def case(**command: object) -> Case:
    measurement = {"torque": "command", "command": command}
    return load_case({
        "robot": {"urdf": "example-robot-data:ur10"}, "measurement": measurement,
        "effects": FRICTION,
    })  # fmt: skip


def joints(values: tuple[float, ...]) -> dict[str, float]:
    return dict(zip(arm().joint_names, values, strict=True))


def law_of_log(data: Dataset, problem: Case) -> FoundLaw:
    runs = with_torques(data, problem.spec.measurement).runs
    return find_law(problem.robot, problem.base, runs, problem.spec)


@pytest.mark.long
@pytest.mark.parametrize(("delay", "rate"), [(0.0, 250.0), (0.009, 250.0), (0.02, 100.0)])
def test_a_delay_is_found_within_a_millisecond(delay: float, rate: float) -> None:
    found = law_of_log(followed(delay, rate), case(kp=joints(KP), kd=joints(KD)))
    assert found.law.delay == pytest.approx(delay, abs=1e-3)
    assert found.delay_std is not None
    assert found.gain_std is None


@pytest.mark.long
def test_a_drive_that_saturates_is_found_with_its_limit() -> None:
    told = case(kp=joints(KP), kd=joints(KD))
    free = law_of_log(followed(), told)
    assert not free.saturated
    (run,) = with_torques(followed(), told.spec.measurement).runs[:1]
    limit = 0.8 * float(np.abs(free.law.torque(run)[:, 1]).max())
    found = law_of_log(followed(limit=limit), told)
    assert found.saturated == (1,)
    assert found.law.limit[1] == pytest.approx(limit, rel=0.03)
    (delay, warning) = found.findings(arm().joint_names)
    assert (delay.kind, warning.kind) == ("command_delay", "drive_limit")
    assert "saturates at" in warning.text
    assert found.told(told.spec, arm().joint_names).measurement.command.limit == {
        "shoulder_lift_joint": pytest.approx(found.law.limit[1], rel=1e-3)
    }


def test_friction_that_is_all_of_a_torque_is_no_limit() -> None:
    """A real Go2, whose calves carry little but their own friction."""
    folder = Path(__file__).parents[2] / "data" / "go2"
    found = law_of_log(load_data(load_case(folder / "go2.yaml"), [folder / "go2.h5"]),
                       load_case(folder / "go2.yaml"))  # fmt: skip
    assert not found.saturated
    assert found.law.delay == pytest.approx(0.0097, abs=1e-3)


def test_gains_are_found_with_the_scale_of_the_masses() -> None:
    """Of joints that carry the arm; inertias are 10 % off."""
    found = law_of_log(followed(), case())
    assert found.gain_std is not None
    off = np.log(found.law.kp / KP)
    assert np.abs(off[:3]).max() < 0.3
    assert (np.abs(off) < 3.0 * found.gain_std + 0.05).all()
    assert np.abs(off[3:5]).max() < 0.45, "of wrists likewise, by the size of their drives"
    assert found.gain_std[5] > 3.0 * found.gain_std[:3].max(), "the last one carries nothing"


def test_what_is_found_stands_in_the_fit() -> None:
    problem, notes = case(kd=joints(KD)), list[Note]()
    assert is_sought(problem.spec.measurement)
    found, data = with_drive_law(problem, followed_with(problem), None, notes.append)
    run = data.runs[0]
    assert run.law is not None
    assert all((change != 0.0).any() for change in run.law.unsure(run))
    told = found.spec.measurement.command
    assert not is_sought(found.spec.measurement)
    assert told.delay == pytest.approx(0.009, abs=1e-3)
    assert isinstance(told.kp, dict)
    assert found.spec.identification.gain_std is not None
    first, second = notes
    assert "set points act" in first.text
    assert "measurement.command.kp" in second.text
    assert with_drive_law(found, data, None, notes.append) == (found, data)


def followed_with(problem: Case) -> Dataset:
    return with_torques(followed(), problem.spec.measurement)


@pytest.mark.long
def test_identified_as_by_torque_sensors() -> None:
    """Masses, friction and rotors are those of the robot, by set points and positions alone."""
    found = identify(case(kp=joints(KP), kd=joints(KD)), followed(), tell=lambda note: None)
    assert found.error.mean_relative_moving is not None
    assert found.error.mean_relative_moving < 0.12
    values = dict(zip(found.fit.names, zip(found.fit.values, found.fit.std, strict=True),
                      strict=True))  # fmt: skip
    for joint in arm().joint_names[:3]:
        rotor, deviation = values[f"armature.inertia[{joint}]"]
        assert rotor == pytest.approx(0.5, abs=2.0 * deviation)
        assert deviation < 0.6
        friction, deviation = values[f"viscous_friction.viscous[{joint}]"]
        assert friction == pytest.approx(8.0, abs=2.0 * deviation)


def test_coarse_encoders_do_not_move_the_delay() -> None:
    """Raw positions in the law would: noise times kp and kd is noise of the other columns, too."""
    raw = followed()
    problem = case(kp=joints(KP), kd=joints(KD))
    unsmoothed = tuple(
        replace(run, law=None) for run in with_torques(raw, problem.spec.measurement).runs
    )
    assert all(run.law is not None for run in with_torques(raw, problem.spec.measurement).runs)
    found = find_law(problem.robot, problem.base, unsmoothed, problem.spec)
    assert found.law.delay == pytest.approx(0.009, abs=1e-3)


def test_the_sentences() -> None:
    law = DriveLaw(np.array([20.0, 5.0]), np.zeros(2), np.full(2, np.inf), 0.0082)
    delay, gains = FoundLaw(law, 4e-4, np.array([0.1, 0.4])).findings(("hip", "knee"))
    assert delay.text == (
        "set points act 8.2 ± 0.4 ms after they were recorded (measurement.command.delay: 0.0082)"
    )
    assert delay.settings == {"measurement.command.delay": 0.0082}
    assert "hip 20 ± 2, knee 5 ± 2" in gains.text
    assert gains.settings == {"measurement.command.kp": {"hip": 20.0, "knee": 5.0}}

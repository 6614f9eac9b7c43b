"""Delay and gains of drives found in the log of a MuJoCo robot that reports positions alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from excite_cli import identify, load_case
from excite_cli.api.drive_law import with_drive_law
from excite_cli.api.loading import Case
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
def followed(delay: float = 0.009, rate: float = 250.0) -> Dataset:
    """Three motions of an arm whose drives follow set points, its encoders coarse."""
    robot = arm()
    drive = PositionDrive(KP, KD, rate, delay)
    settings = SimulationSettings(rate=rate, encoder=3e-4, inertia_error=0.1, drive=drive)
    sizes = {"viscous_friction": 8.0, "coulomb_friction": 4.0, "armature": 0.5}
    effects = [
        plant(kind_named(kind), (j,), size, {}) for kind, size in sizes.items()
        for j in range(robot.n)
    ]  # fmt: skip
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


@pytest.mark.parametrize(("delay", "rate"), [(0.0, 250.0), (0.009, 250.0), (0.02, 100.0)])
def test_a_delay_is_found_within_a_millisecond(delay: float, rate: float) -> None:
    found = law_of_log(followed(delay, rate), case(kp=joints(KP), kd=joints(KD)))
    assert found.law.delay == pytest.approx(delay, abs=1e-3)
    assert found.delay_std is not None
    assert found.gain_std is None


def test_gains_are_found_with_the_scale_of_the_masses() -> None:
    """Of joints that carry the arm; inertias are 10 % off."""
    found = law_of_log(followed(), case())
    assert found.gain_std is not None
    off = np.log(found.law.kp / KP)
    assert np.abs(off[:3]).max() < 0.3
    assert (np.abs(off) < 3.0 * found.gain_std + 0.05).all()
    assert (found.gain_std[3:] > 2.0 * found.gain_std[:3]).all(), "wrists carry little"


def test_what_is_found_stands_in_the_fit() -> None:
    problem, notes = case(kd=joints(KD)), list[Note]()
    assert is_sought(problem.spec.measurement)
    found, data, one_off = with_drive_law(problem, followed_with(problem), None, notes.append)
    assert len(one_off) == 2
    assert all((each.runs[0].tau != data.runs[0].tau).any() for each in one_off)
    told = found.spec.measurement.command
    assert not is_sought(found.spec.measurement)
    assert told.delay == pytest.approx(0.009, abs=1e-3)
    assert isinstance(told.kp, dict)
    assert found.spec.identification.gain_std is not None
    first, second = notes
    assert "set points act" in first.text
    assert "measurement.command.kp" in second.text
    again, same, others = with_drive_law(found, data, None, notes.append)
    assert (again, same, len(others)) == (found, data, 1)


def followed_with(problem: Case) -> Dataset:
    return with_torques(followed(), problem.spec.measurement)


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

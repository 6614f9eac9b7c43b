"""Sound runs at any pace raise no alarm; what really changed does, at full pace."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import Case, identify, score
from excite_cli.config.load_spec import load_spec
from excite_cli.summary.score import runs_table, score_data, sentences
from tests.cli.program import SMOKE
from tests.diagnosis.simulated_arm import ELBOW, PITCH, ROBOT, SLIDE, plant, planted

pytest.importorskip("mujoco")

from excite_cli.effects.catalogue import kind_named
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.trajectory.fourier import FourierTrajectory

pytestmark = pytest.mark.long

COULOMB = (3.0, 4.0, 2.0, 0.6, 4.0)  # N·m, N
SLOW = (0.05, 0.1, 0.3, 1.0)
STANDS = "stands"
FAULTS = {
    "payload": ("payload", SLIDE, 0.5),  # 3 % of the arm's mass
    "friction": ("coulomb_friction", ELBOW, COULOMB[ELBOW]),
    "gain": ("torque_gain", PITCH, 0.1),
}


def _motion(name: str, seed: int, pace: float = 1.0, size: float = 1.0) -> PlannedMotion:
    rng = np.random.default_rng(seed)
    trajectory = FourierTrajectory(4, 2 * np.pi / 6.0 * pace)
    coefficients = 0.13 * size * rng.normal(size=(trajectory.n_coefficients, ROBOT.n))
    coefficients[-1] = rng.uniform(-0.5, 0.5, ROBOT.n)
    coefficients[:, -1] *= 0.1
    coefficients[-1, -1] = 0.07
    return PlannedMotion(name, trajectory, coefficients)


@pytest.mark.parametrize("seed", [1, 2])
def test_sound_runs_raise_no_alarm_at_any_pace_and_what_changed_does(
    seed: int, tmp_path: Path
) -> None:
    motions = [_motion(f"own_{k}", 10 * seed + k) for k in range(4)]
    motions += [_motion(f"pace_{pace:g}", 10 * seed + 5, pace) for pace in SLOW]
    motions += [_motion(STANDS, 10 * seed + 5, 0.3, 0.0)]
    motions += [_motion(name, 10 * seed + 6) for name in FAULTS]
    effects = [planted("coulomb_friction", j, size) for j, size in enumerate(COULOMB)]
    effects += [planted("viscous_friction", j, 0.8 * size) for j, size in enumerate(COULOMB)]
    for name, (kind, joint, size) in FAULTS.items():
        effects.append(plant(kind_named(kind), (joint,), size, runs=(name,)))
    settings = SimulationSettings(seed=seed, rate=200.0, noise_correlation=0.8 * (seed % 2))
    data = simulate(ROBOT, motions, settings, effects).dataset
    spec = load_spec(SMOKE, ["effects=[{kind: viscous_friction}, {kind: coulomb_friction}]"])
    fit, own, new = tmp_path / "fit.h5", data.runs[:4], data.runs[4:]
    case = Case(spec, SMOKE.parent, ROBOT)
    identify(case, replace(data, runs=own), output=fit, tell=lambda note: None)
    found = score(fit, replace(data, runs=new), tell=lambda note: None)
    runs = {run.name: run for run in found.runs}
    assert set(runs) == {run.name for run in new}
    assert {name for name, run in runs.items() if run.alarm} == set(FAULTS)
    # A run in which friction may explain everything is not judged.
    assert not runs[STANDS].judged
    assert runs["pace_1"].judged == found.joint_names
    assert "Not judged: " in " ".join(sentences(found))
    (told,) = (each for each in score_data(found)["runs"] if each["name"] == STANDS)
    assert told["judged"] == []
    states = {row[0]: row[5] for row in runs_table(found).rows}
    assert (states[STANDS], states["pace_1"]) == ("not judged", "")

"""Sound runs at any pace raise no alarm; what really changed does, at full pace."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli import Case, Score, identify, score
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.load import load_spec
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import build_robot
from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.summary.score import runs_table, score_data, sentences
from excite_cli.trajectory.fourier import FourierTrajectory

pytest.importorskip("mujoco")
CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
COULOMB = (3.0, 4.0, 2.0, 0.6, 4.0)  # N·m, N
SLOW = (0.05, 0.1, 0.3, 1.0)
STANDS = "stands"


@dataclass(frozen=True)
class Scored:
    found: Score

    def alarms(self, names: tuple[str, ...]) -> list[str]:
        return [run.name for run in self.found.runs if run.name in names and run.alarm]


def _motion(name: str, seed: int, n: int, pace: float = 1.0, size: float = 1.0) -> PlannedMotion:
    rng = np.random.default_rng(seed)
    trajectory = FourierTrajectory(4, 2 * np.pi / 6.0 * pace)
    coefficients = 0.13 * size * rng.normal(size=(trajectory.n_coefficients, n))
    coefficients[-1] = rng.uniform(-0.5, 0.5, n)
    coefficients[:, -1] *= 0.1
    coefficients[-1, -1] = 0.07
    return PlannedMotion(name, trajectory, coefficients)


def _faults() -> list[Planted]:
    def one(run: str, kind: str, joint: int, value: float) -> Planted:
        return plant(kind_named(kind), (joint,), value, runs=(run,))

    return [
        one("payload", "payload", 4, 0.5),  # 3 % of the arm's mass
        one("friction", "coulomb_friction", 2, COULOMB[2]),
        one("gain", "torque_gain", 1, 0.1),
    ]


@pytest.fixture(scope="module", params=[1, 2])
def scored(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Scored:
    seed, folder = request.param, tmp_path_factory.mktemp("slow")
    spec = load_spec(CONFIG, [])
    robot = build_robot(spec.robot, CONFIG.parent)
    n = robot.n
    motions = [_motion(f"own_{k}", 10 * seed + k, n) for k in range(4)]
    motions += [_motion(f"pace_{pace:g}", 10 * seed + 5, n, pace) for pace in SLOW]
    motions += [_motion(STANDS, 10 * seed + 5, n, 0.3, 0.0)]
    motions += [_motion(fault.effect.runs[0], 10 * seed + 6, n) for fault in _faults()]
    effects = [plant(kind_named("coulomb_friction"), (j,), COULOMB[j]) for j in range(n)]
    effects += [plant(kind_named("viscous_friction"), (j,), 0.8 * COULOMB[j]) for j in range(n)]
    settings = SimulationSettings(seed=seed, rate=200.0, noise_correlation=0.8 * (seed % 2))
    data = simulate(robot, motions, settings, [*effects, *_faults()]).dataset
    declared = tuple(EffectSpec(kind=kind) for kind in ("viscous_friction", "coulomb_friction"))
    case = Case(spec.model_copy(update={"effects": declared}), CONFIG.parent, robot)
    fit = folder / "fit.h5"
    identify(case, _part(data, 0, 4), output=fit, tell=lambda note: None)
    return Scored(score(fit, _part(data, 4, None), tell=lambda note: None))


def _part(data: Dataset, first: int, last: int | None) -> Dataset:
    return replace(data, runs=data.runs[first:last])


def test_sound_runs_raise_no_alarm_at_any_pace(scored: Scored) -> None:
    names = (*(f"pace_{pace:g}" for pace in SLOW), STANDS)
    assert {run.name for run in scored.found.runs} >= set(names)
    assert not scored.alarms(names)


def test_what_changed_does(scored: Scored) -> None:
    faults = tuple(fault.effect.runs[0] for fault in _faults())
    assert sorted(scored.alarms(faults)) == sorted(faults)


def test_a_run_in_which_friction_may_explain_everything_is_not_judged(scored: Scored) -> None:
    (run,) = (run for run in scored.found.runs if run.name == STANDS)
    assert not run.judged
    assert "Not judged: " in " ".join(sentences(scored.found))
    (data,) = (each for each in score_data(scored.found)["runs"] if each["name"] == STANDS)
    assert data["judged"] == []
    states = {row[0]: row[5] for row in runs_table(scored.found).rows}
    assert (states[STANDS], states["pace_1"]) == ("not judged", "")
    quick = next(each for each in scored.found.runs if each.name == "pace_1")
    assert quick.judged == scored.found.joint_names

"""Collisions planted in MuJoCo: how many does a detector see, how soon, at one false alarm an hour?

    python -m benchmarks.contacts [--contacts N] [--clean N] [--seed S]

A UR10 is diagnosed on four motions; thresholds come from twenty further sound runs. Then N runs
have a push of 2 to 20 N on the tip for 0.2 to 0.5 s each, other runs have none. Beside thresholds
that follow speed and load (`excite score --thresholds`): fixed ones, of the same law of maxima, and
these raised until they give no more false alarms in the same runs than those that follow.
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.battery.motions import arm, pool, trajectory
from benchmarks.known_payload import friction_of
from excite_cli import Case, Model, diagnose
from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Array, Dataset
from excite_cli.scoring.score import Scorer
from excite_cli.scoring.thresholds import Residual, thresholds_of
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

DAYS, SOUND, BATCH = 4, 20, 20


def main() -> None:
    """Print detection rate, delay, and false alarms of both detectors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--contacts", type=int, default=200)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    of, rng = arm("ur10"), np.random.default_rng([arguments.seed, 17])
    best, base = pool("ur10", int(rng.integers(8))), friction_of(of.robot.n, rng)
    seed, every = int(rng.integers(2**31)), tuple(range(of.robot.n))

    def played(count: int, pushed: bool) -> tuple[Dataset, list[tuple[float, float]]]:
        motions = tuple(
            PlannedMotion(f"motion_{k}", trajectory(), best[int(i)])
            for k, i in enumerate(rng.integers(0, len(best), count), start=1)
        )
        effects, times = list(base), []
        for k in range(count if pushed else 0):
            push = rng.normal(size=3)
            push *= rng.uniform(2.0, 20.0) / np.linalg.norm(push)
            start = float(rng.uniform(2.0, 8.0))
            end = start + float(rng.uniform(0.2, 0.5))
            shape = {"fy": push[1], "fz": push[2], "start": start, "end": end}
            one = plant(kind_named("contact"), every, float(push[0]), shape, (f"motion_{k + 1}",))
            effects.append(one)
            times.append((start, end))
        settings = SimulationSettings(seed=seed, rate=250.0, torque_noise=0.01)
        data = simulate(of.robot, motions, settings, effects).dataset
        own = np.random.default_rng(int(rng.integers(2**31)))  # the simulator's noise is the seed's
        runs = tuple(
            replace(run, tau=run.tau + 0.005 * run.tau.std(axis=0) * own.normal(size=run.tau.shape))
            for run in data.runs
        )
        return replace(data, runs=runs), times

    declared = tuple(EffectSpec(kind=kind) for kind in ("viscous_friction", "coulomb_friction"))
    case = Case(of.spec.model_copy(update={"effects": declared}), Path("configs"), of.robot)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.h5"
        diagnose(case, played(DAYS, False)[0], output=file, tell=lambda note: None)
        scorer = Scorer(Model.load(file).made)
        sound = [x for run in played(SOUND, False)[0].runs for x in scorer.residuals([run])]
        followed = thresholds_of(of.robot.joint_names, sound)
        fixed = thresholds_of(
            of.robot.joint_names,
            [Residual(x.residual, 0 * x.speed + 1.0, 0 * x.load, x.step) for x in sound],
        )
        tests: list[tuple[Residual, tuple[float, float] | None]] = []
        while len(tests) < arguments.contacts + arguments.clean:
            pushed = len(tests) < arguments.contacts
            data, times = played(BATCH, pushed)
            for k, run in enumerate(data.runs):
                (residual,) = scorer.residuals([run])
                first = run.t[-1] - run.t[0] - len(residual.residual) * residual.step
                window = (times[k][0] - first / 2, times[k][1] - first / 2) if pushed else None
                tests.append((residual, window))
    print("detector                      detected   delay median / 90 %   false alarms per hour")
    by_followed = [(followed.beyond(x).max(axis=1), x.step, window) for x, window in tests]
    by_fixed = [
        (fixed.beyond(replace(x, speed=0 * x.speed + 1.0, load=0 * x.load)).max(axis=1), x.step, w)
        for x, w in tests
    ]
    quiet_ones = _Counted.of(by_followed, 1.0)
    raised = next(
        level
        for level in np.geomspace(1.0, 100.0, 400)
        if _Counted.of(by_fixed, float(level)).alarms <= quiet_ones.alarms
    )
    for name, ratios, level in (
        ("speed and load", by_followed, 1.0),
        ("fixed", by_fixed, 1.0),
        (f"fixed, {raised:.2f} times as high", by_fixed, float(raised)),
    ):
        found = _Counted.of(ratios, level)
        middle, late = (1e3 * float(np.quantile(found.delays, x)) for x in (0.5, 0.9))
        print(
            f"{name:28s} {len(found.delays):4d} of {arguments.contacts}   "
            f"{middle:5.0f} / {late:.0f} ms            {3600 * found.alarms / found.seconds:.1f} "
            f"({found.alarms} in {found.seconds / 60:.0f} min)"
        )


@dataclass(frozen=True)
class _Counted:
    """Delays of the pushes that were seen, false alarms, and the seconds without a push."""

    delays: list[float]
    alarms: int
    seconds: float

    @classmethod
    def of(
        cls, tests: list[tuple[Array, float, tuple[float, float] | None]], level: float
    ) -> "_Counted":
        """`tests`: residual over threshold (T,), its step, and when the push was."""
        delays, alarms, seconds = [], 0, 0.0
        for ratio, step, window in tests:
            t = step * np.arange(len(ratio))
            beyond = ratio > level
            quiet = np.ones(len(t), bool)
            if window is not None:
                inside = (t >= window[0]) & (t <= window[1])
                seen = np.flatnonzero(beyond & inside)
                if len(seen):
                    delays.append(float(t[seen[0]] - window[0]))
                quiet = t < window[0] - 0.05
            seconds += float(quiet.sum() * step)
            starts = np.flatnonzero(beyond & quiet)
            alarms += int((np.diff(starts, prepend=-10_000) > 250).sum())
        return cls(delays, alarms, seconds)


if __name__ == "__main__":
    main()

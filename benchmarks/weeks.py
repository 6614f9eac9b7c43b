"""Weeks of a robot in MuJoCo, scored by the model of its first day: what happened, and when?

    python -m benchmarks.weeks [--cases N] [--seed S]

Four motions are diagnosed; then come twenty runs of other motions, one a week, and `excite score`
sees each in a file of its own. The robot is cold in weeks 1 and 2 (dry friction of all joints is
more), carries a payload in week 12, is touched in week 15, and an encoder has slipped from week 17
on. Sizes, joints, noise and friction are drawn from the seed. Every event must be named with its
run, and no other run may raise an alarm. A wrist that slipped may change the torque by less than
the model's own residual: such weeks are counted apart.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.battery.motions import arm, pool, trajectory
from benchmarks.known_payload import friction_of, payload_of
from excite_cli import Case, Model, Score, diagnose, score
from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.catalogue import kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

ROBOTS = ("ur10", "panda")
DAYS, WEEKS = 4, 20
COLD, LOADED, TOUCHED, SLIPPED = (1, 2), (12,), (15,), tuple(range(17, WEEKS + 1))
EXPECTED = {
    **dict.fromkeys(COLD, ("coulomb_friction", "viscous_friction")),
    **dict.fromkeys(LOADED, ("payload",)),
    **dict.fromkeys(TOUCHED, ("contact",)),
    **dict.fromkeys(SLIPPED, ("encoder_offset",)),
}


def weeks(name: str, seed: int, folder: Path) -> tuple[Score, str, dict[int, float]]:
    """The score of twenty weeks, the joint whose encoder slipped, and how far that is seen.

    By week: RMS of the weight that it seems to shift, over the model's own residual, the largest.
    """
    of, rng = arm(name), np.random.default_rng([seed, ROBOTS.index(name)])
    n = of.robot.n
    best = pool(name, int(rng.integers(8)))
    motions = tuple(
        PlannedMotion(f"motion_{k}", trajectory(), best[int(i)])
        for k, i in enumerate(rng.integers(0, len(best), DAYS + WEEKS), start=1)
    )

    def runs(chosen: tuple[int, ...]) -> tuple[str, ...]:
        return tuple(f"motion_{DAYS + week}" for week in chosen)

    base = friction_of(n, rng)
    slipped = int(rng.integers(1, n - 1))  # the first one turns about gravity: no torque tells
    push = rng.normal(size=3)
    push *= rng.uniform(25.0, 60.0) / np.linalg.norm(push)
    start = float(rng.uniform(2.0, 6.0))
    touch = {"fy": push[1], "fz": push[2], "start": start, "end": start + rng.uniform(0.4, 1.5)}
    angle = float(rng.choice([-1, 1]) * rng.uniform(0.02, 0.08))
    effects = [
        *base,
        *(
            plant(each.effect.__class__, each.effect.joints,
                  float(each.values[0] * rng.uniform(0.25, 0.5)), runs=runs(COLD))
            for each in base if each.effect.kind == "coulomb_friction"
        ),
        *(payload_of(n - 1, float(rng.uniform(1.0, 4.0)), rng.uniform(0.0, 0.1, 3), run)
          for run in runs(LOADED)),
        plant(kind_named("contact"), tuple(range(n)), float(push[0]), touch, runs(TOUCHED)),
        plant(kind_named("encoder_offset"), (slipped,), angle, runs=runs(SLIPPED)),
    ]  # fmt: skip
    settings = SimulationSettings(
        seed=int(rng.integers(2**31)),
        rate=250.0,
        torque_noise=float(rng.uniform(0.005, 0.02)),
        noise_correlation=float(rng.choice([0.0, 0.8])),
    )
    data = simulate(of.robot, motions, settings, effects).dataset
    declared = tuple(EffectSpec(kind=kind) for kind in ("viscous_friction", "coulomb_friction"))
    case = Case(of.spec.model_copy(update={"effects": declared}), Path("configs"), of.robot)
    first = folder / f"{name}_{seed}.h5"
    diagnose(case, part(data, 0, DAYS), output=first, overwrite=True, tell=lambda note: None)
    files = []
    for week in range(1, WEEKS + 1):
        files.append(folder / f"week_{week:02d}.h5")
        write_dataset(files[-1], part(data, DAYS + week - 1, DAYS + week), {})
    found = score(first, files, tell=lambda note: None)
    model, seen = Model.load(first), {}
    for week in SLIPPED:
        q = data.runs[DAYS + week - 1].q
        still, off = np.zeros_like(q), angle * np.eye(n)[slipped]
        shift = model.torque(q + off, still, still) - model.torque(q, still, still)
        assert found.made is not None
        own = np.array([found.made.rms[joint] for joint in of.robot.joint_names])
        seen[week] = float((np.sqrt(np.mean(np.square(shift), axis=0)) / own).max())
    return found, of.robot.joint_names[slipped], seen


def part(data: Dataset, first: int, last: int) -> Dataset:
    """Some of the runs."""
    return replace(data, runs=data.runs[first:last])


def main() -> None:
    """Print what was said of every week that has an event or an alarm, and the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    right = events = alarms = quiet = hidden = named_hidden = 0
    for k in range(arguments.cases):
        with tempfile.TemporaryDirectory() as folder:
            found, slipped, seen = weeks(ROBOTS[k % 2], arguments.seed * 1000 + k, Path(folder))
        print(f"case {k}: {ROBOTS[k % 2]}, slipped: {slipped}", flush=True)
        for week, run in enumerate(found.runs, start=1):
            kinds = EXPECTED.get(week)
            named = run.reasons[0].effect.kind if run.reasons else ""
            worst = max(run.ratio.values())
            if kinds is None:
                quiet += 1
                alarms += run.alarm
            else:
                hit = run.alarm and named in kinds
                if week in SLIPPED:
                    hit = hit and run.reasons[0].effect.joints == (slipped,)
                if seen.get(week, 1.0) < 1.0:
                    hidden, named_hidden = hidden + 1, named_hidden + hit
                else:
                    events, right = events + 1, right + hit
            if run.alarm or kinds:
                told = "; ".join(
                    f"{each.effect.kind}@{'+'.join(each.effect.joints[:2])} {each.share:.0%}"
                    for each in run.reasons
                )
                state = "" if kinds is None else ("right" if hit else "WRONG")
                state = "lost" if state == "WRONG" and seen.get(week, 1.0) < 1.0 else state
                print(f"  week {week:2d} ratio {worst:5.2f} {'ALARM' if run.alarm else '     '} "
                      f"{state or 'FALSE':5s} {told}", flush=True)  # fmt: skip
    print(f"\nevents named with their run: {right} of {events} ({right / events:.1%})")
    print(f"slips below the model's own residual: {named_hidden} of {hidden} named")
    print(f"alarms in the other runs: {alarms} of {quiet} ({alarms / quiet:.1%})")


if __name__ == "__main__":
    main()

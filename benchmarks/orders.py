"""A payload in one of four runs, and whether it matters in which order the files are given.

    python -m benchmarks.orders [--held-out RUN]

A UR10 whose inertias are off by 20 % and whose torques by 8 %, with load-dependent friction on its
elbow, carries 2.6 kg in run "loaded" and nothing in "a", "b" and "c". All 24 orders are diagnosed:
what is named and of which run, and the error before and after on the held-out run (the last one,
unless `--held-out` names it). Where the loaded run is held out itself, nothing tells of the
payload.
"""

import argparse
import itertools
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.battery.motions import CONFIGS
from benchmarks.campaigns.instruments import Instruments, recorded
from benchmarks.campaigns.mechanisms import Carried, solid
from benchmarks.campaigns.motions import series
from benchmarks.campaigns.robots import robot_of
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import Case
from excite_cli.config.data_spec import EffectSpec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import ExciteError
from excite_cli.measurement.dataset import Dataset
from excite_cli.simulation.ground_truth import Planted, parse_planted
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

RUNS = ("a", "b", "c", "loaded")
_MASS, _CENTER = 2.6, np.array([0.02, -0.03, 0.08])
_FRICTION = (EffectSpec(kind="viscous_friction"), EffectSpec(kind="coulomb_friction"))
_PLANTED = ("load_dependent_friction@elbow_joint=0.06",)
_GAIN, _INERTIA = 0.08, 0.2
_SEED = 24
_NAN = float("nan")


@dataclass(frozen=True)
class Answer:
    """Names of one order, or why it was refused; of payloads the runs, and the first one's mass."""

    order: tuple[str, ...]
    held_out: str
    names: tuple[str, ...]
    payloads: tuple[tuple[str, ...], ...]
    mass: tuple[float, float]
    before: float
    after: float
    loaded: tuple[float, float]

    @property
    def right(self) -> bool:
        """The payload, of the loaded run alone if that was not held out, and the friction."""
        wanted = () if self.held_out == "loaded" else (("loaded",),)
        return self.payloads == wanted and any(
            name.startswith("load_dependent_friction@elbow_joint") for name in self.names
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--held-out", choices=RUNS)
    held_out = parser.parse_args().held_out
    case, data = made()
    found = []
    with threadpool_limits(1):
        for order in itertools.permutations(RUNS):
            found.append(answer(case, data, order, held_out))
            print(line(found[-1]), flush=True)
    print("\n".join(summary(found)))


def made() -> tuple[Case, Dataset]:
    """The robot as it is declared, and its four runs."""
    of = robot_of("ur10")
    rng = np.random.default_rng([_SEED, 1])
    spec = of.spec.model_copy(update={"effects": _FRICTION})
    planted = [Planted(Carried((of.robot.n - 1,), {}, ("loaded",)), solid(_MASS, _CENTER, rng))]
    for text in _PLANTED:
        planted += parse_planted(text, of.robot, {})
    settings = SimulationSettings(seed=_SEED, rate=250.0, torque_noise=0.0, inertia_error=_INERTIA)
    played = simulate(
        of.robot, series(of, RUNS, rng), settings, planted, declared_effects(_FRICTION, of.robot)
    )
    data = recorded(played.dataset, Instruments(_SEED, 0.01)).dataset
    runs = tuple(replace(run, tau=(1.0 + _GAIN) * run.tau) for run in data.runs)
    return Case(spec, CONFIGS, of.robot), replace(data, runs=runs)


def answer(case: Case, data: Dataset, order: tuple[str, ...], held_out: str | None) -> Answer:
    """Of the runs in this order."""
    out = held_out or order[-1]
    by_name = {run.name: run for run in data.runs}
    ordered = replace(data, runs=tuple(by_name[name] for name in order))
    try:
        found = diagnose(case, ordered, held_out, tell=lambda note: None)
    except ExciteError as error:
        return Answer(
            order, out, (f"refused: {error}",), (), (_NAN, _NAN), _NAN, _NAN, (_NAN, _NAN)
        )
    payloads = [each for each in found.effects if each.effect.kind == "payload"]
    mass = payloads[0].parameters["mass"] if payloads else None
    return Answer(
        order,
        out,
        tuple(f"{e.effect.kind}@{'+'.join(e.effect.joints) if len(e.effect.joints) < 4 else 'all'}"
              for e in found.effects),
        tuple(each.effect.runs for each in payloads),
        (mass.value, mass.std) if mass else (_NAN, _NAN),
        found.before.mean_relative,
        found.after.mean_relative,
        _loaded(found),
    )  # fmt: skip


def _loaded(found: Diagnosis) -> tuple[float, float]:
    """Errors of the held-out part of loaded runs, where there is one."""
    for part in getattr(found, "parts", ()):
        if "loaded" in part.runs:
            return part.before.mean_relative, part.after.mean_relative
    return _NAN, _NAN


def line(a: Answer) -> str:
    """One order."""
    payloads = "; ".join("+".join(runs) or "all runs" for runs in a.payloads) or "none"
    return (
        f"{' '.join(a.order):18} payload in {payloads:12} {a.mass[0]:5.2f} ± {a.mass[1]:4.2f} kg  "
        f"held out {100 * a.before:5.2f} -> {100 * a.after:5.2f} %  loaded part "
        f"{100 * a.loaded[0]:5.2f} -> {100 * a.loaded[1]:5.2f} %  "
        f"{'right' if a.right else 'WRONG'}: {', '.join(a.names)}"
    )


def summary(found: Sequence[Answer]) -> list[str]:
    """How many orders are right, and whether all say the same."""
    trained = [a for a in found if a.held_out != "loaded"]
    return [
        f"{sum(a.right for a in trained)} of {len(trained)} orders with the loaded run in training "
        "name the payload for that run alone, and the load-dependent friction",
        f"{sum(a.right for a in found) - sum(a.right for a in trained)} of "
        f"{len(found) - len(trained)} with it held-out name that friction and no payload",
        f"{sum(a.after < a.before for a in found)} of {len(found)}: the held-out error falls",
        f"{len({tuple(sorted(a.names)) for a in trained})} different sets of names",
    ]


if __name__ == "__main__":
    main()

"""What a diagnosis costs when there are many runs: time per sample and peak memory.

    python -m benchmarks.runs [--only NAME …] [--limit GB]

A UR10 with load-dependent friction on its elbow and a payload in every fourth run, 500 Hz: 4, 16
and 60 runs of 3 s, 33 runs of 6–60 s, and three runs that bursts of NaN cut into 42 parts. Torque
is computed, not simulated: it is the cost that counts here. Each campaign is diagnosed from its
file in a process of its own, which may not take more memory than `--limit`; time is of the
processor and memory the largest that was resident, libraries and all. Ratios are to the four runs.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.campaigns.instruments import noise_of
from benchmarks.campaigns.mechanisms import slice_of, solid
from benchmarks.problems import CONFIGS
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import load_case
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.robot.model import Array, Robot
from excite_cli.trajectory.fourier import FourierTrajectory

_RATE, _NOISE = 500.0, 0.01
_FRICTION = (4.0, 3.0)  # viscous and Coulomb friction of every joint [N·m·s/rad, N·m]
_LOAD_FRICTION, _ELBOW = 0.06, 2
_BURST = 0.3  # s
_DECLARED = 'effects=[{"kind": "viscous_friction"}, {"kind": "coulomb_friction"}]'


@dataclass(frozen=True)
class Campaign:
    """`seconds` of its runs; each is cut into `parts` by bursts of NaN."""

    words: str
    seconds: tuple[float, ...]
    parts: int = 1


CAMPAIGNS = {
    "4": Campaign("4 runs of 3 s", (3.0,) * 4),
    "16": Campaign("16 runs of 3 s", (3.0,) * 16),
    "60": Campaign("60 runs of 3 s", (3.0,) * 60),
    "33": Campaign("33 runs of 6–60 s", tuple(np.linspace(6.0, 60.0, 33))),
    "nan": Campaign("3 runs, bursts of NaN, 42 parts", (45.0,) * 3, 14),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=CAMPAIGNS, default=list(CAMPAIGNS))
    parser.add_argument("--limit", type=float, default=4.0, help="memory of a process [GB]")
    parser.add_argument("--child", choices=CAMPAIGNS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child is not None:
        limit = int(arguments.limit * 1e9)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        print(json.dumps(cost(CAMPAIGNS[arguments.child])))
        return
    print(f"{'campaign':34} {'samples':>8} {'s':>7} {'ms/sample':>9} {'ratio':>5} {'MB':>6} "
          f"{'ratio':>5}  named")  # fmt: skip
    first: dict[str, Any] | None = None
    for name in arguments.only:
        found = _apart(name, arguments.limit)
        first = first or (found if name == "4" and "error" not in found else None)
        print(row(CAMPAIGNS[name], found, first), flush=True)


def row(campaign: Campaign, found: dict[str, Any], first: dict[str, Any] | None) -> str:
    """A line of the table."""
    if "error" in found:
        return f"{campaign.words:34} {found['error']}"
    each = found["seconds"] / found["samples"]
    ratios = ("", "")
    if first is not None:
        ratios = (
            f"{each / (first['seconds'] / first['samples']):.2f}",
            f"{found['megabytes'] / first['megabytes']:.2f}",
        )
    return (
        f"{campaign.words:34} {found['samples']:8} {found['seconds']:7.1f} {1e3 * each:9.3f} "
        f"{ratios[0]:>5} {found['megabytes']:6.0f} {ratios[1]:>5}  {', '.join(found['named'])}"
    )


def _apart(name: str, limit: float) -> dict[str, Any]:
    """The cost, by a process of its own."""
    words = [sys.executable, "-m", "benchmarks.runs", "--child", name, "--limit", str(limit)]
    run = subprocess.run(words, capture_output=True, text=True, check=False)
    if run.returncode:
        last = (run.stderr.strip().splitlines() or [f"ended with status {run.returncode}"])[-1]
        return {"error": f"not within {limit:g} GB: {last}"}
    found: dict[str, Any] = json.loads(run.stdout)
    return found


def cost(campaign: Campaign) -> dict[str, Any]:
    """Seconds, samples, peak memory and names of the diagnosis of a campaign."""
    case = load_case(CONFIGS / "ur10.yaml", [_DECLARED])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.h5"
        write_dataset(path, made(case.robot, campaign), {})
        began = time.process_time()
        found = diagnose(case, path, tell=lambda note: None)
        seconds = time.process_time() - began
    return {
        "seconds": seconds,
        "samples": round(_RATE * sum(campaign.seconds)),
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6,
        "named": [f"{e.effect.kind}@{_where(e.effect.joints, e.effect.runs)}"
                  for e in found.effects],
    }  # fmt: skip


def _where(joints: tuple[str, ...], runs: tuple[str, ...]) -> str:
    where = "+".join(joints) if len(joints) < 4 else "all"
    return where + (f" in {len(runs)} runs" if runs else "")


def made(robot: Robot, campaign: Campaign) -> Dataset:
    """The runs, all different."""
    rng = np.random.default_rng(60)
    phi = standard_parameters(robot)
    loaded = phi.copy()
    loaded[slice_of(robot, robot.n - 1)] += solid(2.6, np.array([0.02, -0.03, 0.08]), rng)
    runs = []
    for k, seconds in enumerate(campaign.seconds):
        run = _run(robot, loaded if k % 4 == 1 else phi, f"run_{k + 1}", seconds, rng)
        runs.append(_cut(run, campaign.parts))
    return Dataset(robot.joint_names, tuple(runs))


def _run(robot: Robot, phi: Array, name: str, seconds: float, rng: np.random.Generator) -> Run:
    trajectory = FourierTrajectory(5, 2 * np.pi / min(seconds, 10.0))
    coefficients = rng.normal(size=(11, robot.n)) * 0.25
    t = np.arange(round(seconds * _RATE)) / _RATE
    q, v, a = trajectory.states(t, coefficients)
    load = RigidBody(robot, phi, q, v, a).load
    tau = load + _FRICTION[0] * v + _FRICTION[1] * np.tanh(v / 0.01)
    tau[:, _ELBOW] += _LOAD_FRICTION * np.abs(load[:, _ELBOW]) * np.tanh(v[:, _ELBOW] / 0.01)
    run = Run(name, t, q + 1e-6 * rng.normal(size=q.shape), tau, v)
    return Run(name, t, run.q, tau + noise_of(run, _NOISE, 0.0, rng), v)


def _cut(run: Run, parts: int) -> Run:
    """Bursts of NaN in all channels, evenly over the run."""
    length = round(_BURST * _RATE)
    for at in np.linspace(0, len(run.t), parts + 1)[1:-1].astype(int):
        for channel in (run.q, run.tau, run.dq):
            if channel is not None:
                channel[at : at + length] = np.nan
    return run


if __name__ == "__main__":
    main()

"""Plan motions and check them: `excite optimize` and `excite check` from Python."""

# %% [markdown]
# # Motions that make inertial parameters visible
# What `excite optimize` and `excite check` do, from Python. Run it cell by cell, or as
# `python examples/exciting.py`.

# %%
from pathlib import Path

import numpy as np

from excite_cli import check, load_problem, motions_of, plan

configs = Path(__file__).resolve().parents[1] / "configs"

# %% [markdown]
# A problem is a YAML file; every key can be overridden. Here a small arm, and few iterations.

# %%
problem = load_problem(configs / "smoke.yaml", ["optimizer.max_iterations=30"])
print(f"{problem.robot.name}: {problem.robot.n} joints, {problem.base.rank} base parameters")

# %%
result = plan(problem)
for motion in result.motions:
    print(
        f"motion {motion.index}: condition number {motion.condition_number:.2f}, "
        f"with all earlier ones {motion.stacked_condition_number:.2f} ({motion.status})"
    )

# %% [markdown]
# A motion is known at any time: positions, speeds and accelerations, (T, n) each.

# %%
first = motions_of(result)[0]
t = np.linspace(0.0, first.trajectory.duration, 1001)
q, v, a = first.trajectory.states(t, first.coefficients)
for name, column in zip(problem.robot.joint_names, v.T, strict=True):
    print(f"{name}: up to {np.abs(column).max():.2f} per second")

# %% [markdown]
# Before a robot plays it, a second pair of eyes looks at it.

# %%
for name, seen in check(problem, result).items():
    print(name, {constraint: state for constraint, (state, reason) in seen.states.items()})
    assert seen.violations == 0

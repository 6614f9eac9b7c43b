"""Identify a robot from measured data: `excite simulate` and `excite identify` from Python."""

# %% [markdown]
# # Parameters from measured data
# What `excite simulate` and `excite identify` do, from Python. A simulated robot stands for yours:
# in place of `simulate`, read your log with `load_data(problem, "measured.csv")`.

# %%
from pathlib import Path
from tempfile import mkdtemp

from excite_cli import (
    identify,
    load_data,
    load_problem,
    plan,
    read_fit,
    save_fit,
    simulate,
    write_dataset,
)

configs = Path(__file__).resolve().parents[1] / "configs"
folder = Path(mkdtemp())

# %%
problem = load_problem(
    configs / "smoke.yaml", ["optimizer.max_iterations=15", "sequence.motions=2"]
)
recording = simulate(problem, plan(problem))
write_dataset(folder / "measured.h5", recording.dataset, {"simulated": True})

# %%
data = load_data(problem, folder / "measured.h5")
for run in data.runs:
    print(f"{run.name}: {len(run.t)} samples, {run.duration:.1f} s")

# %% [markdown]
# The last run is sealed: it takes no part in the fit, and the errors are measured on it.

# %%
found = identify(problem, data)
print(f"{found.error.mean_relative_moving:.2%} of the torque on {found.sealed_run} is left")
for name, value, std in zip(found.fit.names, found.fit.values, found.fit.std, strict=True):
    print(f"{name}: {value:.4f} ± {std:.4f}")

# %%
save_fit(folder / "fit.h5", problem, found)
print(read_fit(folder / "fit.h5").sealed_run)

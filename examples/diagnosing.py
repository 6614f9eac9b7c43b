"""Find what a model lacks: `excite diagnose` and `optimize --after` from Python."""

# %% [markdown]
# # What the model lacks
# What `excite diagnose` and `excite optimize --after` do, from Python. The simulated arm has a
# friction in its elbow that the config does not know.

# %%
from pathlib import Path
from tempfile import mkdtemp

from excite_cli import (
    diagnose,
    load_problem,
    plan,
    plan_after,
    read_diagnosis,
    save_config,
    simulate,
)

configs = Path(__file__).resolve().parents[1] / "configs"
folder = Path(mkdtemp())

# %%
problem = load_problem(
    configs / "smoke.yaml", ["optimizer.max_iterations=15", "sequence.motions=3"]
)
recording = simulate(problem, plan(problem), effects=["coulomb_friction@elbow=1.5"])

# %%
found = diagnose(problem, recording.dataset, output=folder / "diagnosis.h5")
for named in found.effects:
    joints, p = ", ".join(named.effect.joints), max(named.p_value, 1e-16)
    print(f"{named.effect.kind} on {joints}, p at most {p:.1g}")
    for name, found_value in named.parameters.items():
        print(f"  {name} = {found_value.value:.4f} ± {found_value.std:.4f} {found_value.unit}")
    print(f"  cannot be told apart from: {[alias.kind for alias in named.aliases] or 'nothing'}")
before, after = found.before.mean_relative_moving, found.after.mean_relative_moving
print(f"error on {found.sealed_run}: {before:.2%} before, {after:.2%} after")

# %%
save_config(folder / "better.yaml", problem, found)
following = plan_after(problem, read_diagnosis(folder / "diagnosis.h5"))
for message in following.messages:
    print(message)

"""Time of a call of the exported C file, beside Pinocchio's recursive Newton–Euler.

    python -m benchmarks.c_model

Rigid bodies of the URDF with viscous, Coulomb and load-dependent friction on every joint, gcc -O2
and clang -O2 where there is one. Pinocchio (`rnea`) knows the rigid bodies only, and is called from
Python: its wrapper costs about a microsecond.
"""

import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import pinocchio as pin

from benchmarks.battery.motions import CONFIGS
from excite_cli.config.load import load_spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import kind_named
from excite_cli.export.c_model import c_model
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot, build_robot

ROBOTS = ("ur10", "panda", "talos_arms", "talos_whole_body")
CALLS = 20_000


def main() -> None:
    """Print microseconds per call."""
    compilers = [name for name in ("gcc", "clang") if shutil.which(name)]
    print(f"{'robot':18s} joints  {'  '.join(f'C, {name:5s}' for name in compilers)}   rnea")
    for name in ROBOTS:
        path = CONFIGS / f"{name}.yaml"
        robot = build_robot(load_spec(path, []).robot, path.parent)
        kinds = ("viscous_friction", "coulomb_friction", "load_dependent_friction")
        effects = tuple(kind_named(kind)((j,)) for kind in kinds for j in range(robot.n))
        values = np.full(len(effects), 0.1)
        text = c_model(robot, IdentifiedModel(standard_parameters(robot), effects, values)).text
        own = [_microseconds(text, compiler) for compiler in compilers]
        theirs = _rnea(robot)
        print(f"{name:18s} {robot.n:6d}  {'  '.join(f'{x:8.2f}' for x in own)}   {theirs:.2f}")


def _microseconds(text: str, compiler: str) -> float:
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder) / "model.c", Path(folder) / "model"
        source.write_text(text, encoding="utf-8")
        flags = ["-std=c99", "-O2", "-DEXCITE_MAIN"]
        subprocess.run([compiler, *flags, str(source), "-o", str(program), "-lm"], check=True)
        said = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    found = re.search(r"([\d.]+) us per call", said)
    assert found is not None
    return float(found.group(1))


def _rnea(robot: Robot) -> float:
    q, v, a = robot.draw_states(1, seed=1)
    state = robot.configurations(q)[0], robot.velocities(v)[0], robot.velocities(a)[0]
    data = robot.model.createData()
    began = time.perf_counter()
    for _ in range(CALLS):
        pin.rnea(robot.model, data, *state)
    return 1e6 * (time.perf_counter() - began) / CALLS


if __name__ == "__main__":
    main()

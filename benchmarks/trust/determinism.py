"""The same command twice, in fresh processes and under other circumstances: the same numbers?

    python -m benchmarks.trust.determinism [--only CIRCUMSTANCE]

On one machine every number in every file must be the same to the last bit, whatever the number of
threads of the linear algebra library, the seed of Python's hashes, the folder, the language, and
whether the caches of capsules and tables were there before. `seconds` are nobody's numbers.

Other machines are approximated by other kernels of the linear algebra library (OPENBLAS_CORETYPE):
there the largest relative difference of cost and gradient at a given motion, and of the condition
numbers after the same number of iterations, is told.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import program
from benchmarks.trust.kill_commands import ROOT, SMOKE, Content, config, numbers

_COUNT = 20
KERNELS = ("Nehalem", "Sandybridge", "Haswell", "Zen", "SkylakeX")
# What must not change a bit: environment variables over a plain run.
CIRCUMSTANCES: dict[str, dict[str, str]] = {
    "two threads, other hashes": {
        **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "2"), "PYTHONHASHSEED": "1",
    },
    "all threads, other hashes, another language": {
        **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), ""),
        **dict.fromkeys(("LC_ALL", "LANG"), "tr_TR.UTF-8"), "PYTHONHASHSEED": "2",
    },
    "caches cold": {"XDG_CACHE_HOME": "{folder}/cache"},
}  # fmt: skip
_BASE = {"OPENBLAS_NUM_THREADS": "1"}
_OPTIMIZE = f"optimize SMOKE --set optimizer.max_iterations={_COUNT} -o"
LINES = (
    "init --robot ur10 -o arm.yaml",
    "optimize arm.yaml -o ur10.h5 --motions 1 --set optimizer.max_iterations=5",
    f"{_OPTIMIZE} motions.h5",
    "compare-random SMOKE --optimized motions.h5 --candidates 40 --seconds 0 -o random.h5",
    "simulate SMOKE motions.h5 -o data.h5 --rate 200 --effect viscous_friction@elbow=3",
    "identify SMOKE data.h5 -o fit.h5",
    "diagnose SMOKE data.h5 -o found.h5 --apply better.yaml",
    f"{_OPTIMIZE} next.h5 --after found.h5 --motions 1",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="this circumstance alone")
    asked = parser.parse_args()
    root = Path(tempfile.mkdtemp(prefix="excite-same-"))
    try:
        plain = _chain(root / "plain", {})
        bad = 0
        for name, changes in CIRCUMSTANCES.items():
            if asked.only in (None, name):
                found = _chain(root / name.split(",")[0].replace(" ", "-"), changes)
                bad += _tell_same(name, plain, found)
        bad += _resumed(root, plain)
        if asked.only is None:
            _kernels(root)
        sys.exit(1 if bad else 0)
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _chain(folder: Path, changes: Mapping[str, str]) -> dict[str, Content]:
    """The whole loop in `folder`; the content of all its files."""
    folder.mkdir()
    for line in LINES:
        excite(line, folder, changes)
    files = sorted(each for each in folder.iterdir() if each.is_file())
    return {each.name: (numbers if each.suffix == ".h5" else config)(each) for each in files}


def excite(line: str, folder: Path, changes: Mapping[str, str]) -> None:
    """Run the program to its good end."""
    more = {key: value.format(folder=folder) for key, value in changes.items()}
    arguments = [SMOKE if word == "SMOKE" else word for word in line.split()]
    program.excite(*arguments, folder=folder, **{**_BASE, **more})


def _tell_same(name: str, first: dict[str, Content], second: dict[str, Content]) -> int:
    """Print which files differ and where; returns how many."""
    bad = 0
    for file, content in second.items():
        if content == first[file]:
            continue
        bad += 1
        keys = [key for key in content if content[key] != first[file].get(key)]
        print(f"{name}: {file} differs in {', '.join(keys[:6])}", flush=True)
    print(
        f"{name}: {len(second) - bad} of {len(second)} files the same to the last bit", flush=True
    )
    return bad


def _resumed(root: Path, plain: dict[str, Content]) -> int:
    """Motions one at a time, each in a process of its own, against both in one."""
    folder = root / "resumed"
    folder.mkdir()
    for count in ("1", "2"):
        excite(f"{_OPTIMIZE} motions.h5 --motions {count} --resume", folder, {})
    return _tell_same("resumed", plain, {"motions.h5": numbers(folder / "motions.h5")})


_AT_A_MOTION = """
import json, sys
import numpy as np
from pathlib import Path
from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import build_problem
from excite_cli.store.result_file import read_result
config = Path(sys.argv[1])
problem = build_problem(load_spec(config, []), config.parent)
alpha = read_result(Path(sys.argv[2])).motions[0].coefficients
value, gradient, _ = problem.objective().value_and_gradient(alpha, problem.criterion)
print(json.dumps([float(value), np.ravel(gradient).tolist()]))
"""


def _kernels(root: Path) -> None:
    """Cost and gradient at one motion, and the end of an optimisation, with other kernels."""
    folder, costs, ends = root / "kernels", dict[str, Any](), dict[str, Any]()
    folder.mkdir()
    for kernel in ("", *KERNELS):
        changes = {"OPENBLAS_CORETYPE": kernel}
        output = f"motions{kernel}.h5"
        try:
            excite(f"{_OPTIMIZE} {output}", folder, changes)
            costs[kernel] = _at_a_motion(root / "plain" / "motions.h5", changes)
        except RuntimeError:
            print(f"kernel {kernel}: this processor cannot run it")
            continue
        content = numbers(folder / output)
        table = np.frombuffer(
            content["tables/condition_number"][2], [("i", "i8"), ("own", "f8"), ("stacked", "f8")]
        )
        ends[kernel] = np.concatenate([table["own"], table["stacked"]])
    value, gradient = costs[""]
    for kernel in KERNELS:
        if kernel in costs:
            other, slope = costs[kernel]
            off = np.linalg.norm(np.subtract(slope, gradient)) / np.linalg.norm(gradient)
            end = np.max(np.abs(ends[kernel] / ends[""] - 1))
            print(
                f"kernel {kernel:12} cost {abs(other / value - 1):.1e}, gradient {off:.1e}, "
                f"condition numbers after {_COUNT} iterations {end:.1e} (relative)",
                flush=True,
            )


def _at_a_motion(result: Path, changes: Mapping[str, str]) -> Any:
    words = [sys.executable, "-c", _AT_A_MOTION, SMOKE, result]
    return program.ran(words, ROOT, **{**_BASE, **changes}).answer


if __name__ == "__main__":
    main()

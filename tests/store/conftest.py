from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.random_baseline import random_baseline
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import new_result
from excite_cli.store.own_file import versions
from excite_cli.store.result_file import write_result
from tests.excitation.smoke import planned

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"


@dataclass(frozen=True)
class Stored:
    """A short run over the smoke problem and the file that it was written to."""

    problem: Problem
    result: Result
    path: Path


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Stored:
    folder = tmp_path_factory.mktemp("stored")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        spec = load_spec(CONFIG, ["optimizer.max_iterations=4", "seed=5"])
        problem = build_problem(spec, CONFIG.parent)
        result = planned(problem, new_result(problem, [], versions()))
        baseline = random_baseline(problem, 2, spec.seed, 3, 0.0, lambda drawn, best: None)
    result = replace(
        result,
        priors=("earlier.h5",),
        random=baseline.motions,
        random_candidates=(baseline.candidates, baseline.admissible),
    )
    path = folder / "result.h5"
    write_result(path, result, problem)
    return Stored(problem, result, path)


@pytest.fixture
def copy(stored: Stored, tmp_path: Path) -> Path:
    """A copy of the file, to be damaged."""
    path = tmp_path / "copy.h5"
    path.write_bytes(stored.path.read_bytes())
    return path

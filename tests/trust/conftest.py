from dataclasses import dataclass
from pathlib import Path

import pytest

from excite_cli import diagnose, identify, load_problem, plan, save_fit, simulate
from excite_cli.measurement.hdf5_writer import write_dataset

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"


@dataclass(frozen=True)
class Loop:
    """The files of one short loop on the small arm."""

    folder: Path

    @property
    def result(self) -> Path:
        return self.folder / "result.h5"

    @property
    def data(self) -> Path:
        return self.folder / "data.h5"

    @property
    def fit(self) -> Path:
        return self.folder / "fit.h5"

    @property
    def diagnosis(self) -> Path:
        return self.folder / "diagnosis.h5"


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    """Plan, simulate, identify, diagnose: never written to again."""
    made = Loop(tmp_path_factory.mktemp("loop"))
    problem = load_problem(SMOKE, ["optimizer.max_iterations=4", "diagnosis.rounds=2"])
    result = plan(problem, output=made.result)
    data = simulate(problem, result, ["coulomb_friction@elbow=3"]).dataset
    write_dataset(made.data, data, {})
    save_fit(made.fit, problem, identify(problem, data))
    diagnose(problem, data, output=made.diagnosis)
    return made

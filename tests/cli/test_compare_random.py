import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import build_problem
from excite_cli.store.result_file import read_result
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, SMOKE, Program


def test_random_beside_optimised(excite: Program, two_motions: Run) -> None:
    answer = excite.answer(
        "compare-random", SMOKE, *BRIEF, "--candidates", "4", "--optimized", two_motions.path,
        "-o", "both.h5",
    )  # fmt: skip
    assert answer["candidates"] >= 4
    assert 0 < answer["admissible"] <= answer["candidates"]
    stored = read_result(two_motions.path)
    assert [m["condition_number"] for m in answer["optimized"]] == [
        m.condition_number for m in stored.motions
    ]
    random = answer["random"]
    assert [m["index"] for m in random] == [1, 2]
    assert [path.name for path in excite.folder.iterdir()] == ["both.h5"]  # no claim is left
    both = read_result(excite.folder / "both.h5")
    objective = build_problem(load_spec(SMOKE, ["constraints={}"]), SMOKE.parent).objective()
    blocks = [objective.block(motion.coefficients) for motion in both.random]
    for index, motion in enumerate(random):
        own, stacked = (
            np.linalg.cond(np.vstack(rows))
            for rows in (blocks[index : index + 1], blocks[: index + 1])
        )
        assert motion["condition_number"] == pytest.approx(own, rel=1e-6)
        assert motion["stacked_condition_number"] == pytest.approx(stacked, rel=1e-6)
    assert [m.condition_number for m in both.random] == [m["condition_number"] for m in random]
    assert both.random_candidates == (answer["candidates"], answer["admissible"])
    assert len(both.motions) == 2


def test_it_optimises_first_where_there_is_no_result(excite: Program, two_motions: Run) -> None:
    answer = excite.answer("compare-random", SMOKE, *BRIEF, "--candidates", "2", "--motions", "1")
    (motion,) = answer["optimized"]
    first = read_result(two_motions.path).motions[0]
    assert motion["condition_number"] == first.condition_number
    assert len(answer["random"]) == 1
    assert list(excite.folder.iterdir()) == []  # no -o, no file

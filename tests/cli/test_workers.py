"""`--workers` and `--scheduler` as a user gives them."""

import json

from excite_cli.store.result_file import read_result
from tests.api.test_on_disk import same
from tests.cli.program import SMOKE, Program

BRIEF = (
    "--set", "optimizer.max_iterations=4", "--set", "constraints.self_collision=null",
    "--set", "optimizer.max_seconds=600", "--motions", "1",
)  # fmt: skip


def test_starts_shared_by_two_are_stored_alike(excite: Program) -> None:
    asked = ("optimize", SMOKE, *BRIEF, "--starts", "2", "--json")
    runs = [excite(*asked, "-o", "alone.h5"), excite(*asked, "-o", "shared.h5", "--workers", "200")]
    assert "200 workers share" in runs[1].stderr
    assert "hint: 2 starts" in runs[1].stderr
    assert "hint" not in runs[0].stderr
    alone, shared = (json.loads(run.stdout) for run in runs)
    assert alone["motions"][0]["iterations"] == 8
    for answer in (alone, shared):
        del answer["motions"][0]["seconds"], answer["output"]
    assert alone == shared
    first, second = (read_result(excite.folder / f"{name}.h5") for name in ("alone", "shared"))
    assert same(first, second)


def test_two_places_are_one_too_many(excite: Program) -> None:
    both = ("--workers", "2", "--scheduler", "tcp://127.0.0.1:9")
    assert "give one of them" in excite.refused("optimize", SMOKE, *BRIEF, *both)
    assert list(excite.folder.iterdir()) == []

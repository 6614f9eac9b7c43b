import json

from tests.cli.program import SMOKE, Program


def test_the_gradient_of_the_smoke_problem_is_right(excite: Program) -> None:
    run = excite("verify-gradient", SMOKE, "--json")
    assert run.returncode == 0
    answer = json.loads(run.stdout)
    assert answer["variables"] == 5 * (2 * 4 + 1)  # joints × coefficients of 4 harmonics
    assert answer["samples"] == 60
    errors = answer["relative_error"]
    assert set(errors) >= {
        "adjoint_vs_central", "block_vs_central", "adjoint_vs_block", "adjoint_vs_forward"
    }  # fmt: skip
    assert 0 <= errors["adjoint_vs_block"] < 1e-9
    assert 0 < errors["adjoint_vs_central"] < 1e-7
    assert errors["adjoint_vs_central"] < errors["adjoint_vs_forward"] < 1e-3
    assert set(answer["seconds"]) >= {"cost", "adjoint", "block", "forward", "central"}
    assert all(seconds > 0 for seconds in answer["seconds"].values())

"""From an ambiguous diagnosis to one name: the motion that `--after` proposes is played."""

from pathlib import Path

from tests.cli.program import SMOKE, Installed

BRIEF = ("--set", "optimizer.restarts=1", "--set", "optimizer.max_iterations=60")
SLOW = ("--set", "constraints.joint_limits.scale=0.15")
# Quadratic friction, small against noise; at low speed it looks viscous.
SIZE = 0.12
ROBOT = (
    "--effect", f"nonlinear_viscous_friction@elbow={SIZE},power:2",
    "--torque-noise", "0.03", "--seed", "2",
)  # fmt: skip
TRUTH = ("nonlinear_viscous_friction", ["elbow"])


def names(effects: list[dict]) -> list[tuple[str, list[str]]]:
    return [(effect["kind"], effect["joints"]) for effect in effects]


def test_the_next_motion_settles_what_the_first_left_open(
    excite: Installed, tmp_path: Path
) -> None:
    excite.answer("optimize", SMOKE, "-o", "slow.h5", "--motions", "1", *BRIEF, *SLOW)
    excite.answer("simulate", SMOKE, "slow.h5", "-o", "first.h5", "--repeat", "3", *ROBOT)
    first = excite.answer("diagnose", SMOKE, "first.h5", "-o", "diagnosis.h5")
    # Which of the two kinds is named hangs on the noise; that the data cannot tell does not.
    assert len(first["effects"]) == 1
    named, aliases = names(first["effects"])[0], names(first["effects"][0]["alias_set"])
    assert aliases
    assert TRUTH in (named, *aliases)
    assert first["next_experiment"]["purpose"] == "separate"

    run = excite(
        "optimize", SMOKE, "--after", "diagnosis.h5", "-o", "next.h5", "--motions", "1", *BRIEF
    )
    assert run.returncode == 0, run.stderr
    assert f"separates what the data cannot: {named[0]} on elbow / " in run.stderr

    excite.answer("simulate", SMOKE, "next.h5", "-o", "second.h5", *ROBOT)
    files = ("first.h5", "second.h5", "--held-out", "motion_1_take_3")
    both = excite.answer("diagnose", SMOKE, *files)
    assert names(both["effects"]) == [TRUTH]
    assert both["effects"][0]["alias_set"] == []
    assert abs(both["effects"][0]["parameters"]["coefficient"]["value"] / SIZE - 1.0) < 0.15
    assert both["error"]["held_out_run"] == "motion_1_take_3"

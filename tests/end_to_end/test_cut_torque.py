"""A sensor that saturates must not hide what else its joint has."""

from pathlib import Path

import pytest

from tests.cli.program import SMOKE, Installed

pytest.importorskip("mujoco")

RATIO = 0.07
LEVEL = 12.0  # N·m, of 24 that the motions need


def test_friction_of_a_joint_whose_torque_is_cut_is_named(
    tmp_path: Path, excite: Installed
) -> None:
    brief = ("--set", "optimizer.max_iterations=40")
    excite.answer("optimize", SMOKE, *brief, "--motions", "3", "--seed", "3", "-o", "m.h5")
    planted = (
        ("--effect", f"load_dependent_friction@shoulder_pitch={RATIO}"),
        ("--effect", f"torque_saturation@shoulder_pitch={LEVEL}"),
    )
    simulated = ("-o", "log.h5", "--seed", "5", *planted[0], *planted[1])
    excite.answer("simulate", SMOKE, "m.h5", *simulated)
    answer = excite.answer("diagnose", SMOKE, "log.h5", "-o", "found.h5")
    found = {each["kind"]: each for each in answer["effects"]}
    assert set(found) == {"load_dependent_friction", "torque_saturation"}
    assert all(each["joints"] == ["shoulder_pitch"] for each in found.values())
    ratio = found["load_dependent_friction"]["parameters"]["ratio"]["value"]
    # A third of the samples is left for it, and the others hold it to its first estimate.
    assert ratio == pytest.approx(RATIO, rel=0.1)
    level = found["torque_saturation"]["parameters"]["level"]["value"]
    assert level == pytest.approx(LEVEL, rel=0.01)
    assert answer["error"]["after"]["relative_moving"]["shoulder_pitch"] < 0.006

"""The table of real robots: its words follow the answers, and every log is at hand."""

from typing import Any

import pytest

from benchmarks.real_robots import (
    DATA,
    LOGS,
    PART,
    Answer,
    beside_textbook,
    kr300,
    kr300_cad,
    percent,
    row,
    table,
    tiago,
    told,
    tx40,
    ur10,
)
from excite_cli.config.load_spec import load_spec
from tests.cli.program import ROOT


def effect(kind: str, *joints: str, **values: float) -> dict[str, Any]:
    parameters = {name: {"value": value} for name, value in values.items()}
    return {"kind": kind, "joints": list(joints), "parameters": parameters}


def answer(joints: list[str], *effects: dict[str, Any], **more: Any) -> Answer:
    errors = dict.fromkeys(joints, 0.08)
    error = {
        "before": {"mean_relative_moving": 0.942},
        "after": {"mean_relative_moving": 0.0881, "relative_moving": errors},
    }
    return Answer({"effects": list(effects), "error": error, **more})


def test_every_log_has_its_config_which_declares_no_effect() -> None:
    for log in LOGS:
        assert (DATA / log.folder / log.file).is_file()
        assert load_spec(DATA / log.folder / f"{log.folder}.yaml").effects is None
        assert list((DATA / log.folder).glob("LICENSE*"))


def test_data_stay_small() -> None:
    assert sum(path.stat().st_size for path in DATA.rglob("*") if path.is_file()) < 6e6


def test_a_row() -> None:
    found = answer(["shoulder_pan_joint", "wrist_1_joint"],
                   effect("torque_offset", "wrist_1_joint", offset=1.0),
                   effect("viscous_friction", "wrist_1_joint", viscous=1.0),
                   effect("coulomb_friction", "wrist_1_joint", coulomb=1.0),
                   effect("viscous_friction", "shoulder_pan_joint", viscous=1.0))  # fmt: skip
    cells = row(LOGS[1], [found])
    assert cells[1:3] == ("94 %", "8.8 %")
    assert cells[3] == (
        "friction on wrist_1_joint; torque offset of wrist_1_joint; friction concave in speed on "
        "none; load-dependent on none"
    )
    assert ur10([found]) == cells[3]


def test_what_is_named_beside_the_textbook_and_what_that_leaves() -> None:
    on = {"coulomb_friction": "a", "viscous_friction": "a", "armature": "b"}
    plain = [effect(kind, joint, size=1.0) for kind, joint in on.items()]
    gains = [effect("torque_gain", joint, gain=0.1) for joint in "ba"]
    found = answer(["a", "b"], *plain, *gains)
    found.content["error"]["textbook"] = {"mean_relative_moving": 0.112}
    assert beside_textbook([found]) == (
        "friction on a; torque gain of a and b; the textbook's model leaves 11 %"
    )


def test_published_values_that_were_missed_are_named() -> None:
    viscous = (8.05, 5.53, 1.97, 1.11, 1.86, 0.8)  # the last is 23 % off
    coulomb = (7.14, 8.26, 6.34, 2.48, 3.03)  # joint 6 has none
    joints = [f"joint_{j}" for j in range(1, 7)]
    lines = [
        {"joint": j, "viscous": {"value": v}, "coulomb": {"value": c}}
        for j, v, c in zip(joints, viscous, (*coulomb, float("nan")), strict=True)
    ]
    own = effect("viscous_friction", "joint_1", viscous=3.0)  # beside a refinement: no matter
    pair = effect("coupled_friction", "joint_5", "joint_6", viscous=0.616, coulomb=2.1)
    words = tx40([answer(joints, own, pair, friction_lines=lines)])
    assert "coupled friction of joint_5–joint_6" in words
    assert "12 of 14 published" in words
    assert "(viscous of joint_6: 23 % off, coulomb of joint_6: – off)" in words


def test_the_spring_with_inertias_free_and_kept() -> None:
    axes = ["axis_2", "axis_3"]
    absorbed = [{"kind": "spring", "joints": ["axis_2"], "by": ["mx[axis_2]", "my[axis_2]"]}]
    assert "would be absorbed by mx[axis_2] and my[axis_2]" in kr300(
        [answer(axes, absorbed=absorbed)]
    )
    assert "is not said to be absorbed" in kr300([answer(axes, absorbed=[])])
    splits = [
        answer(axes, effect("spring", "axis_2", stiffness=k),
               effect("armature", "axis_2", inertia=844 * share),
               effect("armature", "axis_3", inertia=751.0))
        for k, share in ((6900.0, 1.04), (7100.0, 0.93))
    ]  # fmt: skip
    words = kr300_cad(splits)
    assert "6.9 to 7.1 kN·m/rad over the 2 splits" in words
    assert "within 7.0 % of the data sheet" in words
    splits[0].content["effects"].pop(0)
    assert "7.1 kN·m/rad over 1 of the 2 splits" in kr300_cad(splits)


def test_what_tiago_leaves_open() -> None:
    arm = [f"arm_{j}_joint" for j in range(1, 5)]
    words = tiago([answer(arm, findings=[{"kind": "lag"}, {"kind": "jitter"}])])
    assert words.startswith("told of the data: speeds that lag; named: none. arm_2_joint")
    assert words.endswith("come to 8.0 %, 8.0 % and 8.0 %")


def test_the_table_takes_the_place_between_the_marks() -> None:
    page = f"before\n{PART.begin}\nold\n{PART.end}\nafter\n"
    assert PART.replaced(page, table([("a", "1 %", "2 %", "b")])) == (
        f"before\n{PART.begin}\n| log | before | after | what was found |\n"
        f"| --- | --- | --- | --- |\n| a | 1 % | 2 % | b |\n{PART.end}\nafter\n"
    )
    with pytest.raises(ValueError, match="lacks"):
        PART.replaced("nothing", "")
    results = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    assert PART.replaced(results, "x").count("x\n" + PART.end) == 1


def test_words() -> None:
    assert [told([]), told(["a"]), told(["a", "b", "c"])] == ["none", "a", "a, b and c"]
    assert [percent(0.942), percent(0.0881), percent(0.0996)] == ["94 %", "8.8 %", "10 %"]

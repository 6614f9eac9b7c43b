"""Robots at hand, and the joints of one."""

from collections.abc import Sequence

from excite_cli.fields import data_of
from excite_cli.robot.description import EXAMPLE_PREFIX
from excite_cli.robot.overview import DescribedRobot, Glance
from excite_cli.shown.answer import Answer, Parts, Table, show


def robots_answer(found: Sequence[Glance], names: Sequence[str]) -> Answer:
    """What `excite robots` answers; `names` are all short names, aliases included."""
    rows = []
    for each in found:
        there = {
            "inertias": each.inertias,
            "visual geometry": each.visual,
            "collision geometry": each.collision,
        }
        lacks = ", ".join(word for word, is_there in there.items() if not is_there)
        rows.append(
            {
                "name": each.name,
                "kind": each.kind,
                "joints": str(each.joints),
                "lacks": lacks,
                "also called": ", ".join(each.others),
            }
        )
    left, words = ("name", "kind"), ("lacks", "also called")
    table = Table.of("Robots of example-robot-data", rows, left, words)
    hint = f"In a config: robot: {{urdf: {EXAMPLE_PREFIX}NAME}}. Joints: excite robots NAME"
    data = {
        "robots": [f"{EXAMPLE_PREFIX}{name}" for name in names],
        "details": {
            each.name: {
                **data_of(each, "kind", "joints", "inertias", "visual", "collision"),
                "also_called": list(each.others),
                "file": str(each.path),
            }
            for each in found
        },
    }
    return Answer((table, hint), data)


def robot_answer(found: DescribedRobot) -> Answer:
    """What `excite robots NAME` answers."""
    own = ("kind", "lower", "upper", "velocity", "effort", "links", "followers")
    data = {
        "joints": {joint.name: data_of(joint, *own) for joint in found.joints},
        "base_links": list(found.base_links),
    }
    return Answer(tuple(robot_parts(found)), data)


def robot_parts(found: DescribedRobot) -> Parts:
    """Joints with their limits, and the links of the base."""
    sliding = any(joint.kind == "prismatic" for joint in found.joints)
    unit = "rad, rad/s, N·m; prismatic: m, m/s, N" if sliding else "rad, rad/s, N·m"
    rows = (
        {
            "joint": joint.name,
            **({"kind": joint.kind} if sliding else {}),
            "lower": _limit(joint.lower),
            "upper": _limit(joint.upper),
            "speed": _limit(joint.velocity),
            "effort": _limit(joint.effort),
            "links": ", ".join(joint.links),
        }
        for joint in found.joints
    )
    table = Table.of(f"{_in_words(found)} ({unit})", rows, ("joint", "kind"), ("links",))
    return [table, f"links fixed to the world: {', '.join(found.base_links)}"]


def _limit(value: float) -> str:
    return f"{value:.4g}" if abs(value) < float("inf") else "-"


def _in_words(found: DescribedRobot) -> str:
    return f"{found.name}: {len(found.joints)} joints"


show(DescribedRobot, _in_words, robot_parts)

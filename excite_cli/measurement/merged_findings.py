"""Findings of one kind as one sentence: the first as it is, of the others where they are.

A fault of a recorder is found on many joints and in many runs. A record of each stays in the data;
to a person it is told once.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from excite_cli.measurement.dataset import Finding

_LISTED = 8  # places that are named


def merged(findings: Iterable[Finding]) -> list[Finding]:
    """One finding for all of the same kind and severity, in the order of the first of each.

    What is about no run and no joint stands for itself.
    """
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for found in findings:
        placed = bool(found.run or found.joints)
        key = (found.kind, found.severity, "" if placed else found.text)
        groups.setdefault(key, []).append(found)
    return [_one(group) for group in groups.values()]


def _one(group: Sequence[Finding]) -> Finding:
    first = group[0]
    same = [found for found in group if found.text == first.text]
    runs = dict.fromkeys(found.run for found in same if found.run)
    others: dict[str, dict[str, None]] = {}
    for found in group:
        if found.text != first.text:
            others.setdefault(", ".join(found.joints), {})[found.run] = None
    text = first.text
    if others:
        places = [_place(joints, list(runs)) for joints, runs in others.items()]
        more = f", and {len(places) - _LISTED} more" if len(places) > _LISTED else ""
        text = f"{text.removesuffix('.')}; likewise {'; '.join(places[:_LISTED])}{more}"
    joints = tuple(dict.fromkeys(joint for found in group for joint in found.joints))
    settings: dict[str, Any] = {}
    for found in group:
        settings = joined(settings, found.settings)
    return replace(first, text=text, run=", ".join(runs), joints=joints, settings=settings)


def joined(some: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of both: mappings and lists of names have what either has, else the later holds."""
    found = dict(some)
    for key, value in more.items():
        old = found.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            found[key] = {**old, **value}
        elif isinstance(old, list) and all(isinstance(each, str) for each in value):
            found[key] = list(dict.fromkeys([*old, *value]))
        else:
            found[key] = value
    return found


def _place(joints: str, runs: Sequence[str]) -> str:
    """`elbow (a, b)`, `elbow`, or `a, b`."""
    where = ", ".join(run for run in runs if run)
    if not joints:
        return where or "elsewhere"
    return f"{joints} ({where})" if where else joints

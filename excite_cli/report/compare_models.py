"""Several fits, or several diagnoses, side by side: errors, what was found, what differs."""

from collections.abc import Mapping

import numpy as np

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.identification.stored_fit import StoredFit
from excite_cli.report.config_differences import differences
from excite_cli.report.page import Block, Section, Table


def compare_fits(fits: Mapping[str, StoredFit]) -> Section:
    """Errors of several fits on held-out data, what the data fix, and the differing keys."""
    rows = tuple(
        (
            name,
            stored.held_out_run,
            _percent(stored.training_error.mean_relative_moving),
            _percent(stored.error.mean_relative_moving),
            f"{int(np.sum(stored.fit.identifiable))} of {len(stored.fit.names)}",
        )
        for name, stored in fits.items()
    )
    table = Table(
        ("file", "held-out run", "training error", "held-out error", "identifiable"),
        rows,
        title="Mean relative error of the torque where joints move",
        right=frozenset({2, 3, 4}),
    )
    configs = [stored.config for stored in fits.values()]
    blocks: tuple[Block, ...] = (table, differences(list(fits), configs))
    return Section("compare-fits", "Fits side by side", blocks)


def compare_diagnoses(diagnoses: Mapping[str, Diagnosis]) -> Section:
    """What several diagnoses found, their errors on held-out data and the differing keys."""
    rows = tuple(
        (
            name,
            diagnosis.held_out_run,
            _percent(diagnosis.before.mean_relative_moving),
            _percent(diagnosis.after.mean_relative_moving),
            "; ".join(
                f"{each.effect.kind.replace('_', ' ')} on {', '.join(each.effect.joints)}"
                for each in diagnosis.effects
            )
            or "nothing",
        )
        for name, diagnosis in diagnoses.items()
    )
    errors = Table(
        ("file", "held-out run", "error before", "error after", "found"),
        rows,
        title="Mean relative error of the torque where joints move, on held-out data",
        right=frozenset({2, 3}),
    )
    blocks: list[Block] = [errors, *_by_joint(diagnoses)]
    names = list(diagnoses)
    blocks.append(differences(names, [diagnosis.config for diagnosis in diagnoses.values()]))
    return Section("compare-diagnoses", "Diagnoses side by side", tuple(blocks))


def _by_joint(diagnoses: Mapping[str, Diagnosis]) -> list[Block]:
    joints = dict.fromkeys(joint for each in diagnoses.values() for joint in each.joint_names)
    rows = tuple(
        (
            joint,
            *(
                f"{_of(each.before.relative_moving, joint)} → "
                f"{_of(each.after.relative_moving, joint)}"
                for each in diagnoses.values()
            ),
        )
        for joint in joints
    )
    right = frozenset(range(1, len(diagnoses) + 1))
    title = "The same joint by joint, before → after"
    return [Table(("joint", *diagnoses), rows, title, right)]


def _of(errors: Mapping[str, float], joint: str) -> str:
    return _percent(errors[joint]) if joint in errors else "–"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if np.isfinite(share) else "–"

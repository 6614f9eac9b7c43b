"""The problem of a config with the effects that a diagnosis found in it."""

import os
from pathlib import Path

from excite_cli.config.spec import Spec
from excite_cli.config.write import yaml_text
from excite_cli.diagnosis.candidates import effect_of
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.export.parameters import effect_specs


def found_config(
    spec: Spec, folder: Path, found: Diagnosis, path: Path, smallest: bool = False
) -> str:
    """YAML text of `spec`, its effects the declared and the found ones (or the `smallest` set).

    Relative paths of `spec` start from `folder`; those of the text start from the folder of `path`,
    where it is to be written.
    """
    tree = spec.model_dump(mode="json", exclude_unset=True)
    target = path.resolve().parent
    urdf = spec.robot.urdf
    if ":" not in urdf and not Path(urdf).is_absolute():
        tree["robot"]["urdf"] = os.path.relpath(folder / urdf, target)
    if spec.robot.package_dirs:
        tree["robot"]["package_dirs"] = [
            os.path.relpath(folder / each, target) for each in spec.robot.package_dirs
        ]
    kept, after = found.effects, found.after.mean_relative_moving
    if smallest and found.path is not None:
        kept, after = found.smallest, found.path.sealed[found.path.smallest]
    records = [*found.declared, *(named.effect for named in kept)]
    effects = [effect_of(record, found.joint_names) for record in records]
    tree["effects"] = effect_specs(effects, found.joint_names)
    some = f" of {len(found.effects)}" * smallest
    comment = (
        f"{len(kept)}{some} effects found by `excite diagnose`, added to the declared model.\n"
        f"Mean relative error on {found.sealed_run}: {found.before.mean_relative_moving:.2%} "
        f"before, {after:.2%} after (moving samples)."
    )
    return yaml_text(tree, comment)

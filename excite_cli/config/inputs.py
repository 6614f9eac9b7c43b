"""The files that a config stands for: itself, and those that it names."""

from pathlib import Path

from excite_cli.config.spec import Spec


def files_of_config(spec: Spec, folder: Path, config: Path | None) -> tuple[Path, ...]:
    """The config (if it is a file), its URDF and the fit of `uncertainty.fit`, there or not.

    Relative paths start from `folder`.
    """
    named = [spec.robot.urdf]
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        named.append(spec.uncertainty.fit)
    own = () if config is None else (config,)
    return (*own, *(folder / name for name in named))

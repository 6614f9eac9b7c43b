"""What a fit file knows of the inertias: the ellipsoid of `uncertainty.fit`."""

from pathlib import Path

from excite_cli.config.load import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.uncertain_inertias import FitKnowledge
from excite_cli.errors import FileError
from excite_cli.store.fit_file import read_fit


def fit_knowledge(spec: Spec, folder: Path) -> FitKnowledge | None:
    """Values and covariance of the fit that `uncertainty.fit` names; None where it names none.

    Its path starts from `folder`.

    Raises
    ------
    FileError
        It cannot be read, or was made with another payload.
    """
    if spec.uncertainty is None or spec.uncertainty.fit is None:
        return None
    path = folder / spec.uncertainty.fit
    if not path.is_file():
        raise FileError(
            f"uncertainty.fit: there is no file {path}. Write one with `excite identify`, or leave "
            "it out."
        )
    stored = read_fit(path)
    fit = stored.fit
    carried = parse_spec(stored.config, f"the config stored in {path}").robot.payload
    if carried != spec.robot.payload:
        raise FileError(
            f"uncertainty.fit: {path} was made with another robot.payload, so its inertias are "
            "others. Identify with the payload of this config, or give the same one."
        )
    return FitKnowledge(
        values=fit.base_values,
        covariance=fit.covariance[: fit.rank, : fit.rank],
        names=fit.names[: fit.rank],
        fingerprint=stored.fingerprint,
        source=spec.uncertainty.fit,
    )

"""Whether a fit is good on the data that it was fitted to only, and what to do then.

Free inertias on motions that excite little fit noise: the sealed error is then many times that of
the training data, or more than that of the URDF with nothing fitted.
"""

from excite_cli.diagnosis.records import Diagnosis, Overfit
from excite_cli.identification.fit_words import relative_in_words

# Sealed over training error, and the sealed error, from which on a fit is told to be overfit. On
# real and simulated logs with enough motion the ratio is 1 to 3.
_RATIO, _LEAST = 5.0, 0.05
_BETTER = 0.9  # of the sealed error: what is lower with kept inertias


def is_overfit(found: Diagnosis, inertias: str) -> bool:
    """Whether the fit, of free inertias, does not hold on sealed data."""
    if inertias == "cad" or found.trained is None:
        return False
    sealed = found.after.mean_relative_moving
    if found.untouched is not None and sealed > found.untouched.mean_relative_moving:
        return True
    return sealed > max(_RATIO * found.trained.mean_relative_moving, _LEAST)


def overfit_of(found: Diagnosis, kept: Diagnosis | None) -> Overfit:
    """The errors that say so; `kept`: the same data with the URDF's inertias."""
    assert found.trained is not None
    return Overfit(
        found.trained.mean_relative_moving,
        found.after.mean_relative_moving,
        found.untouched.mean_relative_moving if found.untouched else None,
        kept.after.mean_relative_moving if kept else None,
    )


def overfit_in_words(found: Overfit) -> str:
    """The errors, and what to do."""
    training, sealed = map(relative_in_words, (found.training, found.sealed))
    text = (
        f"Overfit: the model leaves {training} of the torque that it was fitted to and {sealed} of"
    )
    text += " the sealed one"
    if found.untouched is not None and found.untouched < found.sealed:
        alone = relative_in_words(found.untouched)
        text += f", more than the URDF with nothing fitted ({alone})"
    text += "; these motions do not determine its inertias."
    if found.kept is None:
        return f"{text} Record motions that excite more (`excite optimize`)."
    kept = relative_in_words(found.kept)
    if found.kept < _BETTER * found.sealed:
        return (
            f"{text} With the URDF's inertias kept (identification.inertias: cad) it is {kept}: "
            "set that, or record motions that `excite optimize` plans."
        )
    return (
        f"{text} Keeping the URDF's does not help ({kept}). Record motions that excite more "
        "(`excite optimize`)."
    )

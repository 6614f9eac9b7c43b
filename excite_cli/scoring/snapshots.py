"""What a fit, a diagnosis or a score says of its day, as numbers that can be compared."""

from collections.abc import Iterator
from dataclasses import replace

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.fit import Fit
from excite_cli.identification.stored_fit import StoredFit
from excite_cli.scoring.changes import Known, Snapshot
from excite_cli.scoring.records import Score

# By which such ratios differ between sound runs of different motions, one standard deviation:
# simulated ones lie between 0.9 and 1.9.
_OF_A_MOTION = 0.2


def of_fit(name: str, stored: StoredFit) -> Snapshot:
    """Base parameters and effects that the data fix."""
    fit = stored.fit
    known = {
        name: Known(float(fit.values[i]), float(fit.std[i]), fit.units[i])
        for i, name in enumerate(fit.names)
        if fit.identifiable[i]
    }
    for i, effect, label in _owners(fit):
        if fit.names[i] in known and len(effect.joints) == 1 and not effect.runs:
            known[fit.names[i]] = replace(
                known[fit.names[i]],
                joint=fit.joint_names[effect.joints[0]],
                quantity=_quantity(effect.kind, label),
                friction=effect.friction,
            )
    return Snapshot(name, known, stored.recorded.epoch, stored.recorded.covariates)


def _owners(fit: Fit) -> Iterator[tuple[int, Effect, str]]:
    """Every parameter of an effect by its place, the effect, and its name there."""
    at = fit.rank
    for effect in fit.effects:
        for parameter in effect.parameters:
            yield at, effect, parameter.name
            at += 1


def _quantity(kind: str, label: str) -> str:
    return f"{kind_named(kind).title}: {label}"


def of_diagnosis(name: str, found: Diagnosis) -> Snapshot:
    """Base parameters, the data-sheet lines of friction, and all other named effects."""
    known = {
        base: Known(float(value), float(std))
        for base, value, std in zip(
            found.base_names, found.base_values, found.base_std, strict=True
        )
        if std < 0.5 * abs(value)
    }
    for line in found.friction_lines:
        for part, value in (("viscous", line.viscous), ("Coulomb", line.coulomb)):
            label = f"{part} friction[{line.joint}]"
            known[label] = Known(
                value.value, value.std, value.unit, line.joint, False, f"{part} friction", True
            )
    for named in found.effects:
        effect = named.effect
        if effect.runs or (len(effect.joints) == 1 and kind_named(effect.kind).friction):
            continue
        for label, value in named.parameters.items():
            if value.std == value.std:  # shapes have none
                place = ",".join(effect.joints)
                joint = effect.joints[0] if len(effect.joints) == 1 else ""
                known[f"{effect.kind}.{label}[{place}]"] = Known(
                    value.value, value.std, value.unit, joint, True,
                    _quantity(effect.kind, label), kind_named(effect.kind).friction,
                )  # fmt: skip
    return Snapshot(name, known, found.recorded.epoch, found.recorded.covariates)


def of_score(name: str, score: Score) -> list[Snapshot]:
    """Every run: RMS of each joint's residual over what the model allows."""
    return [
        Snapshot(
            f"{name}: {run.name}",
            {
                f"residual over allowed[{joint}]": Known(
                    ratio, _OF_A_MOTION * ratio, "1", joint, False, "residual over allowed"
                )
                for joint, ratio in run.ratio.items()
                if ratio == ratio
            },
            run.epoch,
            run.covariates,
        )
        for run in score.runs
    ]

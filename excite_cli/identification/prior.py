"""The prior of the inertias that a fit takes: which of them it is, and how wide it must be."""

from collections.abc import Callable
from typing import TypeVar

from excite_cli.config.data_spec import IdentificationSpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, InertialPrior, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.robot.model import Array, Robot

Fit = TypeVar("Fit")

_WIDENINGS = 8
_UNKNOWN = 1.0


def as_wide_as_needed(
    prior: InertialPrior,
    base: BaseParameters,
    fitted: Callable[[InertialPrior], tuple[Array, Fit]],
) -> tuple[InertialPrior, Fit]:
    """The prior, `widened` until it agrees with what is `fitted` with it, and that fit.

    `fitted` gives the parameters of a fit, base parameters first, and the fit.
    """
    values, found = fitted(prior)
    for _ in range(_WIDENINGS):
        wider = prior.widened(base, values[: base.rank])
        if wider is prior:
            break
        prior, (values, found) = wider, fitted(wider)
    return prior, found


def prior_of(spec: IdentificationSpec, robot: Robot, weighed: bool) -> InertialPrior | None:
    """What `spec` takes the URDF's inertias to be worth; None where nothing is known of them.

    `weighed`: scales tell some parameters. They tell masses from gains, which the URDF's masses
    would tell beside them, so that only what somebody says of these (`cad`) counts.
    """
    cad = standard_parameters(robot)
    share = {"auto": UNSURE, "free": _UNKNOWN, "cad": spec.uncertainty}[spec.inertias]
    prior = inertial_prior(robot, cad, share)
    masses = bool((cad[::10] > 0.0).any())
    return prior if spec.inertias == "cad" or (masses and not weighed) else None

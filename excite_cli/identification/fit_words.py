"""A fit in words, the same ones wherever it is reported."""

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from statistics import median

from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.measurement.dataset import Finding, Mask

_STANDS_OUT = 1.5  # times the typical joint


class Identifiable(StrEnum):
    """Whether the data determine a parameter; without one that is `ZERO` the fit is as good."""

    YES = "yes"
    ZERO = "yes (zero within error)"
    NO = "NO"


def fixed_by_data(fit: Fit, i: int) -> Identifiable:
    """Of parameter i of a fit."""
    if not fit.identifiable[i]:
        return Identifiable.NO
    return Identifiable.YES if fit.essential[i] else Identifiable.ZERO


def not_seen(names: Sequence[str], seen: Mask) -> Iterator[Finding]:
    """A note about parameters (p,) that the data do not show, if there are any."""
    unseen = [name for name, ok in zip(names, seen, strict=True) if not ok]
    if unseen:
        text = f"{', '.join(unseen)}: do not show in these data, or only in sums with each other."
        yield Finding("not_seen", "note", text)


def relative_in_words(share: float) -> str:
    """A share in per cent, with two digits that mean something."""
    if not share < 10:
        return "> 1000%"
    return f"{share:.0%}" if share >= 0.1 else f"{100 * share:.2g}%"


def short_number(value: float, digits: int) -> str:
    """So many digits, and no exponent for hundreds and thousands."""
    return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"


def with_deviation(value: float, std: float) -> str:
    """`2.998 ± 0.012`: a value with one standard deviation of two digits, rounded to these.

    Without a deviation that is known, three digits; four where there is none.
    """
    if not math.isfinite(std) or not math.isfinite(value):
        return f"{value:.3g}"
    if std <= 0.0:
        return f"{value:.4g}"
    last = math.floor(math.log10(float(f"{std:.1e}"))) - 1  # place of the second digit
    largest = max(abs(value), std)
    if not 1e-4 <= largest < 1e6:
        digits = max(math.floor(math.log10(largest)) - last, 1)
        return f"{value:.{digits}e} ± {std:.1e}"
    digits = max(-last, 0)
    return f"{round(value, -last):.{digits}f} ± {round(std, -last):.{digits}f}"


def consistency_in_words(fit: Fit) -> str:
    """Whether a physically consistent set fits as well; empty if none was requested."""
    consistent = fit.consistent
    if consistent is None:
        return ""
    if not consistent.solved:
        return f"No physically consistent set of parameters was found: {consistent.status}."
    return (
        "Nearest physically consistent set of standard parameters: "
        f"{max(consistent.cost, 0.0) ** 0.5:.1f} σ from the fit."
    )


def above_the_floor(error: Errors, floor: Mapping[str, float] | None) -> str:
    """How far the RMS errors lie above the noise floor: the median joint, and the worst."""
    ratios = {
        joint: error.rms[joint] / level
        for joint, level in (floor or {}).items()
        if level > 0.0 and math.isfinite(error.rms.get(joint, math.nan))
    }
    if not ratios:
        return ""
    typical, worst = median(ratios.values()), max(ratios, key=lambda joint: ratios[joint])
    stands_out = ratios[worst] > _STANDS_OUT * typical
    return (
        f"The residual is {typical:.1f} times the noise of repeated periods"
        + f" ({worst} {ratios[worst]:.1f} times)" * stands_out
        + "; about 1 is the minimum of a model without drift."
    )

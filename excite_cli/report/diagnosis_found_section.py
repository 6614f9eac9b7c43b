"""The verdict of a diagnosis: what was found, what it only comes near, what cannot be tested."""

from collections.abc import Sequence
from math import isnan

from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.words import (
    SMALL_PART,
    approximation_in_words,
    by_worth,
    changes_in_words,
    counted,
    covariate_in_words,
    held_out_in_words,
    joints_in_words,
    other_name_of,
    p_in_words,
    place_in_words,
    settled_in_words,
    title_of,
    value_in_words,
    weighed_in_words,
)
from excite_cli.report.page import Block, PageSection, TableBlock, Text

_COLUMNS = (
    "effect",
    "where",
    "size ± std",
    "p",
    "share",
    "gain",
    "held-out, without it",
)


def found_section(found: Diagnosis) -> PageSection:
    """Tables of what was found, absorbed and approximated, and the sentences about them."""
    large, small = by_worth(found.named, found)
    if len(small) < 2 or not large:
        large, small = [*large, *small], []
    blocks: list[Block] = []
    if large:
        blocks.append(
            TableBlock(
                (*_COLUMNS, "indistinguishable from"),
                tuple(_row(found, each) for each in large),
                title="What the declared model lacks",
                right=frozenset({3, 4, 5}),
                note=(
                    "share: part of the fall of the mean held-out error (Shapley value: averaged "
                    "over orders of joining, so that all rows add up to it); gain: by which the "
                    "error on training data left out falls; held-out, without it: the verdict, and "
                    "by how much the error of the most affected joint rises if the effect is left "
                    "out."
                ),
            )
        )
    if small:
        blocks.append(
            TableBlock(
                (*_COLUMNS, "indistinguishable from"),
                tuple(_row(found, each) for each in small),
                title=(
                    f"{len(small)} small effects (each below {SMALL_PART:.0%} of the error "
                    "reduction)"
                ),
                right=frozenset({3, 4, 5}),
                folded=True,
            )
        )
    if found.approximations:
        blocks.append(
            TableBlock(
                (*_COLUMNS, "true form"),
                tuple(_row(found, each) for each in found.approximations),
                title="Surrogate terms (they approximate an effect that has no name)",
                right=frozenset({3, 4, 5}),
            )
        )
    blocks += [Text(text) for text in (*weighed_in_words(found), *changes_in_words(found))]
    if found.absorbed:
        blocks.append(_absorbed(found))
    return PageSection("diagnosis-found", "What was found", tuple(blocks), _lead(found))


def verdict(found: Diagnosis) -> str:
    """One sentence: how much was found and what it does to the error."""
    low, high = found.after.interval
    approximations = counted(len(found.approximations), "surrogate term")
    what = counted(len(found.named), "effect")
    what += f" and {approximations}" * bool(found.approximations)
    return (
        f"With {what} the mean error of the torque on {found.held_out_run}, which took no part, "
        f"goes from {found.before.mean_relative_moving:.2%} to "
        f"{found.after.mean_relative_moving:.2%} where joints move (over all samples from "
        f"{found.before.mean_relative:.2%} to {found.after.mean_relative:.2%}, 95% interval "
        f"{low:.2%} to {high:.2%})."
    )


def _lead(found: Diagnosis) -> str:
    declared = (
        ", ".join(dict.fromkeys(title_of(record.kind) for record in found.declared))
        or "no effect beside the rigid bodies"
    )
    if not found.effects:
        return (
            f"With {declared} declared, the mean error of the torque on "
            f"{found.held_out_run}, which took no part, is {found.after.mean_relative_moving:.2%} "
            "where joints move."
        )
    return f"Declared: {declared}. {verdict(found)}"


def _row(found: Diagnosis, named: NamedEffect) -> tuple[str, ...]:
    everything = len(found.joint_names)
    names = [
        f"{title_of(alias.kind)} on {place_in_words(alias, everything)}" for alias in named.aliases
    ]
    if same := other_name_of(named.effect.kind):
        names.append(" together with ".join(map(title_of, same)))
    others = ", ".join(names)
    if named.approximates:
        others = approximation_in_words(named.approximates, covariate_in_words)
    return (
        title_of(named.effect.kind),
        place_in_words(named.effect, everything),
        "; ".join(value_in_words(name, value) for name, value in named.parameters.items()),
        p_in_words(named.p_value, named.least_p),
        _points(named.error_reduction),
        f"{named.gain:.1%}",
        held_out_in_words(named) or "–",
        others or "–",
    )


def _points(share: float) -> str:
    return "–" if isnan(share) else f"{100 * share:.2f} pp"


def _absorbed(found: Diagnosis) -> TableBlock:
    rows = [
        (title_of(each.kind), _where(each.joints, found.joint_names), ", ".join(each.by))
        for each in found.absorbed
    ]
    return TableBlock(
        ("effect", "where", "confounded with"),
        tuple(rows),
        title=f"Not identifiable: {len(rows)} candidates confounded with parameters",
        note=" ".join(
            [
                "Confounded with a change of these parameters in any motion of this kind.",
                *settled_in_words(found),
            ]
        ),
        folded=len(rows) > 6,
    )


def _where(joints: Sequence[str], every: Sequence[str]) -> str:
    return joints_in_words(joints, len(every))

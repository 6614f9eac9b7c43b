"""What a fit changed of the links, as a table, a line on the others, and as data."""

from collections.abc import Sequence
from typing import Any

from excite_cli.identification.fit_words import with_deviation
from excite_cli.identification.link_changes import Change, LinkChange
from excite_cli.shown.table import Parts, Table

_TITLE = (
    "Links deviating from the URDF (± one standard deviation; centre of mass in the link's frame)"
)
_COLUMNS = (
    "link",
    "mass [kg]",
    "URDF",
    "centre [mm]",
    "URDF's",
    "identified",
    "physically infeasible",
)


def link_parts(links: Sequence[LinkChange]) -> Parts:
    """Links that changed by more than two standard deviations or are marked; others counted."""
    if not links:
        return []
    shown = [link for link in links if link.significant or link.marks]
    others = len(links) - len(shown)
    counted = (
        f"{others} {'other ' if shown else ''}link{'s' * (others != 1)} of {len(links)}: mass and "
        "centre within two standard deviations of the URDF's."
    )
    rows = tuple(_row(link) for link in shown)
    left = ("link", "identified", "physically infeasible")
    return [
        *(
            [Table(_TITLE, _COLUMNS, rows, left=left, words=("physically infeasible",))]
            if rows
            else []
        ),
        *([counted] if others else []),
    ]


def link_data(links: Sequence[LinkChange]) -> list[dict[str, Any]]:
    """All links for `--json`: masses [kg], centres [m] in the link's frame."""
    return [
        {
            "link": link.link,
            "joint": link.joint,
            "mass": _data(link.mass),
            "center": {axis: _data(c) for axis, c in zip("xyz", link.center, strict=True)},
            "significant": link.significant,
            "marks": list(link.marks),
        }
        for link in links
    ]


def _data(change: Change) -> dict[str, Any]:
    return {
        "before": change.before,
        "after": change.after,
        "std": change.std,
        "left": change.left,
        "determined": change.determined,
    }


def _row(link: LinkChange) -> tuple[str, ...]:
    """A line per axis in the cells of the centre."""
    known = [
        name
        for name, change in zip(("mass", "x", "y", "z"), (link.mass, *link.center), strict=True)
        if change.determined
    ]
    return (
        link.link,
        with_deviation(link.mass.after, link.mass.std),
        f"{link.mass.before:.4g}",
        "\n".join(with_deviation(1e3 * c.after, 1e3 * c.std) for c in link.center),
        "\n".join(f"{1e3 * c.before:.4g}" for c in link.center),
        ", ".join(known) or "nothing",
        "; ".join(link.marks),
    )

"""The page of a campaign, which grows with its rounds."""

import numpy as np

from excite_cli.campaign.records import Campaign, CampaignRound
from excite_cli.report.page import Charts, KeyFigure, Page, PageSection, TableBlock, Text
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.report.score_sections import table_of
from excite_cli.summary.campaign import rounds_table


def rounds_page(campaign: Campaign, robot: str) -> Page:
    """Error, effects, precision and motion time of every round so far, and what is open."""
    done = [each for each in campaign.rounds if each.learned is not None]
    told = (
        campaign.reason or f"Round {campaign.rounds[-1].number if campaign.rounds else 1} goes on."
    )
    kind = {"complete": "good", "": "plain"}.get(campaign.ended, "bad")
    sections = [PageSection("rounds", "Rounds", (table_of(rounds_table(campaign)),))]
    if done:
        sections.insert(0, PageSection("errors", "Error and precision", (Charts((_plot(done),)),)))
        sections.append(_open(done[-1]))
    sections.append(_motions(campaign))
    return Page(
        f"Campaign of {robot}",
        told,
        (
            KeyFigure("rounds", str(len(campaign.rounds))),
            KeyFigure("motion", f"{campaign.seconds:.0f} s", f"{len(campaign.motions)} motions"),
            *(_figures(done[-1]) if done else ()),
        ),
        tuple(sections),
        (Text(told, kind),) if campaign.ended else (),
    )


def _figures(last: CampaignRound) -> tuple[KeyFigure, ...]:
    learned = last.learned
    assert learned is not None
    return (
        KeyFigure(
            "torque missed",
            f"{learned.after:.2%}",
            f"on {last.motions[-1].name}, which took no part; {learned.before:.2%} without effects",
        ),
        KeyFigure("effects", str(len(learned.effects)), ", ".join(learned.effects)),
    )


def _plot(done: list[CampaignRound]) -> Plot:
    """Errors before and after, and the precision of torques, over the motion seconds so far."""
    learned = [each.learned for each in done if each.learned is not None]
    numbers = np.array([float(each.number) for each in done])
    before, after = (
        np.array([100.0 * getattr(each, name) for each in learned]) for name in ("before", "after")
    )
    known = np.array(
        [np.nan if x.torque_deviation is None else x.torque_deviation for x in learned]
    )
    errors = Panel(
        "held-out error [%]",
        (
            Curve("declared model", before, "vermilion", "joined"),
            Curve("with all effects found", after, "blue", "joined"),
        ),
        height=200,
        logarithmic=bool((before > 0).all() and (after > 0).all()),
    )
    precision = Panel(
        "torque std [σ]",
        (Curve("torque deviation", known, "green", "joined"),),
        height=150,
    )
    return Plot(
        "Rounds",
        f"Held-out error on the newest motion: {before[-1]:.2f} % of the torque with the declared "
        f"model, {after[-1]:.2f} % with all effects found, after {len(done)} rounds.",
        "round",
        numbers,
        (errors, precision) if np.isfinite(known).any() else (errors,),
        caption="Errors are those on the newest motion of each round, which is held out; torque "
        "std: predicted-torque standard deviation at random states, in σ of one sample.",
        wide=True,
        counted=True,
    )


def _open(last: CampaignRound) -> PageSection:
    learned = last.learned
    assert learned is not None
    lines = tuple(Text(each) for each in learned.open) or (Text("Nothing.", "good"),)
    return PageSection("open", "What is open", lines)


def _motions(campaign: Campaign) -> PageSection:
    rows = tuple(
        (
            each.name,
            each.purpose,
            f"{each.pace:.0%}",
            f"{each.seconds:.1f}" if each.data else "",
            each.data or "not measured yet",
            "; ".join(each.rejected),
        )
        for one in campaign.rounds
        for each in one.motions
    )
    columns = ("motion", "for", "pace", "seconds", "log", "rejected recordings")
    table = TableBlock(columns, rows, right=frozenset({2, 3}), wordy=frozenset({5}))
    return PageSection("motions", "Motions", (table,))

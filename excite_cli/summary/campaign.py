"""The rounds of a campaign, and how it ended, in words."""

from dataclasses import asdict
from pathlib import Path

from excite_cli.campaign.records import Campaign, CampaignRound, RoundFindings
from excite_cli.shown.answer import Answer, Part, Table
from excite_cli.shown.record import show


def round_in_words(number: int, learned: RoundFindings) -> str:
    """`round 2: held-out error 1.32% → 0.19% of the torque on the newest motion; …`."""
    named = ", ".join(learned.effects) or "no effect"
    left = (
        "; open: " + "; ".join(learned.open)
        if learned.open
        else "; no ambiguous effects, nothing left to explain"
    )
    return (
        f"round {number}: held-out error {learned.before:.2%} → {learned.after:.2%} of the torque "
        f"on the newest motion, with {named}{left}"
    )


def rounds_table(campaign: Campaign) -> Table:
    """A row per round; seconds of motion add up to those of the campaign."""
    return Table(
        "Rounds (errors: of the torque on the newest motion, which is held out)",
        (
            "round",
            "motions",
            "pace",
            "seconds",
            "efficiency",
            "before",
            "after",
            "torque std [σ]",
            "effects",
        ),
        tuple(_row(each) for each in campaign.rounds),
        words=("effects",),
    )


def _row(each: CampaignRound) -> tuple[str, ...]:
    learned = each.learned
    pace = f"{min(m.pace for m in each.motions):.0%}"
    seconds = f"{sum(m.seconds for m in each.motions if m.data):.0f}"
    measured = sum(bool(m.data) for m in each.motions)
    count = str(measured) if measured == len(each.motions) else f"{measured} of {len(each.motions)}"
    efficiency = "" if each.efficiency is None else f"{each.efficiency:.2%}"
    if learned is None:
        return str(each.number), count, pace, seconds, efficiency, *[""] * 4
    known = learned.torque_deviation
    return (
        str(each.number),
        count,
        pace,
        seconds,
        efficiency,
        f"{learned.before:.2%}",
        f"{learned.after:.2%}",
        "" if known is None else f"{known:.2g}",
        ", ".join(learned.effects),
    )


def campaign_answer(campaign: Campaign, folder: Path, written: dict[str, str]) -> Answer:
    """What `excite campaign` answers; `written`: what is in the folder, by what it is."""
    count = len(campaign.motions)
    total = (
        f"{len(campaign.rounds)} rounds, {count} motions, {campaign.seconds:.0f} s of motion. "
        "(torque std: standard deviation of the predicted torque at random states, in σ of the "
        "torque noise; efficiency: information relative to D-optimal free states)"
    )
    files = tuple(f"{what}: {folder / name}" for what, name in written.items())
    data = {
        "ended": campaign.ended,
        "reason": campaign.reason,
        "rounds": [asdict(each) for each in campaign.rounds],
        "motions": count,
        "seconds": campaign.seconds,
        "folder": str(folder),
        **{what: str(folder / name) for what, name in written.items()},
    }
    table = rounds_table(campaign)
    parts: tuple[Part, ...] = (campaign.reason, table, total, *files)
    return Answer(parts, data, good=campaign.ended == "complete")


show(
    Campaign,
    lambda found: (
        f"{len(found.rounds)} rounds, {found.seconds:.0f} s of motion: {found.ended or 'goes on'}"
    ),
    lambda found: [found.reason, rounds_table(found)],
)

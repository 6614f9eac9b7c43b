"""The rounds of a campaign, and how it ended, in words."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from excite_cli.campaign.records import Campaign, CampaignRound, RoundFindings
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import counted
from excite_cli.fields import data_of
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.report.residual_chart import IN_TIME, noise_by_joint, residuals_in_time
from excite_cli.shown.answer import (
    Answer,
    Charts,
    KeyFigure,
    Page,
    Part,
    Section,
    Table,
    Text,
    Verdict,
    show,
)


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
    title = "Rounds (errors: of the torque on the newest motion, which is held out)"
    return Table.of(title, map(_row, campaign.rounds), words=("effects",))


def _row(each: CampaignRound) -> dict[str, str]:
    learned = each.learned
    measured, every = sum(bool(m.data) for m in each.motions), len(each.motions)
    known = learned and learned.torque_deviation
    return {
        "round": str(each.number),
        "motions": str(measured) if measured == every else f"{measured} of {every}",
        "pace": f"{each.pace:.0%}",
        "seconds": f"{sum(m.seconds for m in each.motions if m.data):.0f}",
        "efficiency": "" if each.efficiency is None else f"{each.efficiency:.2%}",
        "declared": f"{learned.before:.2%}" if learned else "",
        "with effects": f"{learned.after:.2%}" if learned else "",
        "torque std [σ]": "" if known is None else f"{known:.2g}",
        "effects": ", ".join(learned.effects) if learned else "",
    }


def campaign_answer(campaign: Campaign, folder: Path, written: dict[str, str]) -> Answer:
    """What `excite campaign` answers; `written`: what is in the folder, by what it is."""
    count = len(campaign.motions)
    total = (
        f"{counted(len(campaign.rounds), 'round')}, {counted(count, 'motion')}, "
        f"{campaign.seconds:.0f} s of motion. (torque std: standard deviation of the "
        "predicted torque at random states, in σ of the torque noise; efficiency: information "
        "relative to D-optimal free states)"
    )
    files = tuple(f"{what}: {folder / name}" for what, name in written.items())
    data = {
        "ended": campaign.ended,
        "reason": campaign.reason,
        "rounds": data_of(campaign.rounds),
        "motions": count,
        "seconds": campaign.seconds,
        "folder": str(folder),
        **{what: str(folder / name) for what, name in written.items()},
    }
    table = rounds_table(campaign)
    parts: tuple[Part, ...] = (campaign.reason, table, total, *files)
    return Answer(parts, data, good=campaign.ended == "complete")


# The page, which grows with the rounds.


def rounds_page(
    campaign: Campaign, robot: str, files: Mapping[str, str], last: Diagnosis | None = None
) -> Page:
    """Error, effects, precision and motion time of every round so far, and what is open.

    `files` beside the page, by what they are; `last`: the newest diagnosis.
    """
    done = [each for each in campaign.rounds if each.learned is not None]
    told = (
        campaign.reason or f"Round {campaign.rounds[-1].number if campaign.rounds else 1} goes on."
    )
    kind = {"complete": "good", "": "answer"}.get(campaign.ended, "bad")
    sections = [Section("rounds", "Rounds", (rounds_table(campaign),))]
    if done:
        sections.insert(0, Section("errors", "Error and precision", (Charts((_plot(done),)),)))
        sections.append(_open(done[-1]))
    if last is not None:
        sections.append(_residual(last))
    sections.append(_motions(campaign, files))
    count = f"{counted(len(campaign.rounds), 'round')}, {counted(len(campaign.motions), 'motion')}"
    return Page(
        f"Campaign of {robot}",
        f"{count}, {campaign.seconds:.0f} s of motion",
        (*(_figures(done[-1]) if done else ()), _state(campaign, done)),
        tuple(sections),
        (Text(told, kind),),
    )


def _figures(last: CampaignRound) -> tuple[KeyFigure, ...]:
    learned = last.learned
    assert learned is not None
    verdict: Verdict = "open" if learned.open else "good"
    return (
        KeyFigure(
            "torque missed",
            f"{learned.after:.2%}",
            f"on {last.motions[-1].name}, which took no part; {learned.before:.2%} without effects",
            verdict,
            "errors",
        ),
        KeyFigure(
            "effects",
            str(len(learned.effects)),
            "\n".join(learned.effects),
            "open" if learned.pairs else "good",
            "rounds",
        ),
    )


def _state(campaign: Campaign, done: Sequence[CampaignRound]) -> KeyFigure:
    words: dict[str, tuple[str, Verdict]] = {
        "complete": ("converged", "good"),
        "budget": ("the budget is spent", "bad"),
        "stuck": ("effects were not separated", "bad"),
        "": ("goes on", "open"),
    }
    value, verdict = words[campaign.ended]
    left = done[-1].learned.open if done and done[-1].learned else ()
    remark = counted(len(left), "open question") if left else "nothing is open" if done else ""
    anchor = "open" if done else "motions"
    return KeyFigure("the campaign", value, remark, verdict, anchor)


def _residual(last: Diagnosis) -> Section:
    """Of the newest motion, which was held out."""
    names, units, noise = last.joint_names, last.torque_units, noise_by_joint(last)
    blocks = residuals_in_time(last.held_out_traces, names, units, noise)
    lead = f"{IN_TIME} of the model with all effects and of the declared one, over the noise."
    return Section("residual", f"Residual of {last.held_out_run}", blocks, lead)


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
            Curve("with effects", after, "blue", "joined"),
        ),
        height=200,
        logarithmic=bool((before > 0).all() and (after > 0).all()),
    )
    counts = np.array([float(len(each.effects)) for each in learned])
    found = Panel(
        "effects [–]",
        (Curve("effects found", counts, "purple", "steps"),),
        span=(0.0, max(1.0, 1.25 * float(counts.max()))),
        height=90,
    )
    precision = Panel(
        "torque std [σ]",
        (Curve("torque deviation", known, "green", "joined"),),
        height=110,
    )
    panels = (errors, found, precision) if np.isfinite(known).any() else (errors, found)
    return Plot(
        "Rounds",
        f"Held-out error on the newest motion: {before[-1]:.2f} % of the torque with the declared "
        f"model, {after[-1]:.2f} % with all effects found, after {len(done)} rounds.",
        "round",
        numbers,
        panels,
        caption=f"{_new_effects(done)} Errors are those on the newest motion of each round, which "
        "is held out; torque std: predicted-torque standard deviation at random states, in σ of "
        "one sample.",
        wide=True,
        span=(0.75, numbers[-1] + 0.25),
        counted=True,
    )


def _new_effects(done: Sequence[CampaignRound]) -> str:
    """`Round 1: spring on elbow. Round 2: nothing new.`"""
    said, before = [], set[str]()
    for each in done:
        now = set(each.learned.effects) if each.learned else set()
        new = [name for name in each.learned.effects if name not in before] if each.learned else []
        gone = sorted(before - now)
        words = ", ".join([*(f"+ {name}" for name in new), *(f"− {name}" for name in gone)])
        said.append(f"Round {each.number}: {words or 'no change'}.")
        before = now
    return " ".join(said)


def _open(last: CampaignRound) -> Section:
    learned = last.learned
    assert learned is not None
    lines = tuple(Text(each) for each in learned.open) or (Text("Nothing.", "good"),)
    return Section("open", "What is open", lines)


def _motions(campaign: Campaign, files: Mapping[str, str]) -> Section:
    """Every motion, and links to what is in the folder."""
    rows = (
        {
            "motion": f"{each.name}.csv",
            "plan": each.plan,
            "for": each.purpose,
            "pace": f"{each.pace:.0%}",
            "seconds": f"{each.seconds:.1f}" if each.data else "",
            "log": each.data,
            "rejected recordings": "; ".join(each.rejected),
        }
        for one in campaign.rounds
        for each in one.motions
    )
    links = ("motion", "plan", "log")
    played = Table.of(
        "Motions (without a log: not measured yet)",
        rows,
        left=(*links, "for"),
        words=("rejected recordings",),
        files=links,
    )
    columns = ("what", "file")
    beside = Table("Results", columns, tuple(files.items()), left=columns, files=("file",))
    return Section("motions", "Motions and files", (played, beside) if files else (played,))


show(
    Campaign,
    lambda found: (
        f"{len(found.rounds)} rounds, {found.seconds:.0f} s of motion: {found.ended or 'goes on'}"
    ),
    lambda found: [found.reason, rounds_table(found)],
)

"""How the effects were found: round by round the suspects, and why the others were refused."""

from excite_cli.diagnosis.records import Diagnosis, Round
from excite_cli.diagnosis.verdict import Verdict
from excite_cli.diagnosis.words import counted, p_in_words, place_in_words, title_of
from excite_cli.report.page import Block, Fold, Section, Table

_OPEN_ROUNDS = 3


def suspect_section(found: Diagnosis) -> Section:
    """A table for every round; all but a few are folded."""
    tables = [_round(found, each) for each in found.rounds]
    first, later = tables[:_OPEN_ROUNDS], tables[_OPEN_ROUNDS:]
    blocks: tuple[Block, ...] = tuple(first)
    if later:
        last = len(tables)
        words = f"round {last}" if len(later) == 1 else f"rounds {_OPEN_ROUNDS + 1} to {last}"
        blocks = (*first, Fold(f"The other {counted(len(later), 'round')}: {words}", tuple(later)))
    lead = (
        "Every round judges all candidates beside what was found before and takes the one that "
        "saves most. Shown are the strongest candidates and the verdict on each: the p-value is "
        "corrected for the number of tests; the share is of the residual at that point; the gain "
        "is by how much the error on runs left out falls. One that is refused now may be accepted "
        "in a later round."
    )
    return Section("diagnosis-candidates", "Rejected candidates, with reasons", blocks, lead)


def _round(found: Diagnosis, each: Round) -> Table:
    joints = len(found.joint_names)
    worst = max(each.residual, key=lambda joint: each.residual[joint])
    rows = tuple(
        (
            title_of(suspect.effect.kind),
            place_in_words(suspect.effect, joints),
            p_in_words(suspect.p_value, suspect.least_p),
            f"{suspect.share_of_residual:.1%}",
            f"{suspect.gain:.1%}",
            f"{suspect.verdict}: {suspect.why}" if suspect.why else suspect.verdict,
        )
        for suspect in each.suspects
    )
    taken = {k for k, suspect in enumerate(each.suspects) if suspect.verdict is Verdict.ACCEPTED}
    return Table(
        ("candidate", "where", "p", "share", "gain", "verdict"),
        rows,
        title=f"Round {each.index}: RMS residual up to {each.residual[worst]:.3g} ({worst})",
        right=frozenset({2, 3, 4}),
        strong=frozenset(taken),
    )

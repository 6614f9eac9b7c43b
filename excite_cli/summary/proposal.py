"""A proposed config in words."""

from excite_cli.proposal.propose import Proposal
from excite_cli.shown.answer import Answer
from excite_cli.shown.command import Command, as_word
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts


def proposal_answer(found: Proposal, source: str, path: str) -> Answer:
    """What `excite init` answers once the config of the robot `source` is written to `path`."""
    problem = found.settled.problem
    data = {
        "output": path,
        "robot": source,
        "joints": list(found.joints),
        "left_out": {why: list(names) for why, names in found.left_out.items()},
        "base_parameters": problem.base.rank,
        "duration": problem.trajectory.duration,
        "notes": list(found.notes),
    }
    return Answer(
        (*proposal_parts(found), path, "next:", Command(("excite", "optimize", as_word(path)))),
        data,
    )


def proposal_parts(found: Proposal) -> Parts:
    """What moves, and what was chosen and why."""
    return [_in_words(found), *found.notes]


def _in_words(found: Proposal) -> str:
    problem = found.settled.problem
    return (
        f"{problem.robot.name}: moves {len(found.joints)} joints, "
        f"{problem.base.rank} base parameters, {problem.trajectory.duration:.4g} s"
    )


show(Proposal, _in_words, proposal_parts)

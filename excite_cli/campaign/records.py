"""What a campaign has done so far: its rounds, the motions of each, and what they told."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError

from excite_cli.atomic import write_text_atomically
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.errors import FileError, refusal
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Shown

# At what pace the motions of a round are played at least, and which effects a motion looks for.

_FASTER = 2.0  # from round to round


def pace_of(number: int, from_speed: float) -> float:
    """Share of the limits in round `number`, the first being 1, at least: twice as fast each."""
    return min(1.0, from_speed * _FASTER ** (number - 1))


def looked_for(robot: Robot, known: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects that a motion should make visible which nobody has found yet.

    Of every joint, each kind whose torque is a function of the joint's own state (position, speed,
    load), in its usual shape, where `known` has none of that kind. What a log itself may have got
    wrong, or what changes over the days, shows in any motion or in none.
    """
    there = {(each.kind, each.joints) for each in known}
    return tuple(
        kind(joints, dict(kind.defaults))
        for name, kind in catalogue().items()
        if kind.scope == "joint"
        and kind.excitable
        and kind.function_of
        and not (kind.over_time or kind.data_defect or kind.of_campaign or kind.same_as)
        for joints in kind.places(robot)
        if (name, joints) not in there
    )


Purpose = Literal["first", "separate", "excite", "explore"]
# Why a campaign ended.
End = Literal["", "complete", "budget", "stuck"]


@dataclass(frozen=True)
class CampaignOptions:
    """What was asked of a campaign when it began.

    `from_speed`: pace of the first round, as a share of the limits; `most_rounds` and
    `most_seconds` (of motion; 0: no bound) are its budget. `plain`: without motions that explore.
    """

    from_speed: float = 1.0
    most_rounds: int = 8
    most_seconds: float = 0.0
    entry: bool = True
    plain: bool = False


@dataclass(frozen=True)
class PlayedMotion:
    """A motion of a round: where it is planned, and its log once there is a good one.

    `plan` and `data` are names of files in the campaign's folder, `index` is that of the motion in
    its plan. `pace`: share of the limits of speed, acceleration and jerk; `seconds`: how long the
    robot moves, ways included.
    `rejected`: why takes of it were no log of it.
    """

    name: str
    purpose: Purpose
    plan: str
    index: int
    pace: float
    seconds: float = 0.0
    data: str = ""
    rejected: tuple[str, ...] = ()


@dataclass(frozen=True)
class RoundFindings:
    """What the diagnosis after a round says.

    Mean relative errors of the torque on the newest motion, which took no part, where joints move:
    of the declared model (`before`) and with all effects found (`after`). `effects`: what is named,
    and where. `open`: what still matters, in sentences; `pairs`: effects that a motion could tell
    apart. `torque_deviation`: to how much of one sample's noise torques are predicted at random
    states, or those of the work where `sequence.until` asks for these.
    """

    before: float
    after: float
    effects: tuple[str, ...]
    open: tuple[str, ...]
    pairs: tuple[str, ...] = ()
    torque_deviation: float | None = None


@dataclass(frozen=True)
class CampaignRound:
    """Motions that are planned together, and what was learned from them and all before.

    `efficiency`: how much an instant of those planned for the model tells of the inertias, as a
    share of what freely chosen states could.
    """

    number: int
    motions: tuple[PlayedMotion, ...]
    learned: RoundFindings | None = None
    efficiency: float | None = None

    @property
    def missing(self) -> PlayedMotion | None:
        """The first motion that has no log yet."""
        return next((each for each in self.motions if not each.data), None)

    @property
    def pace(self) -> float:
        """Share of the limits of the slowest motion."""
        return min((each.pace for each in self.motions), default=1.0)

    def with_motion(self, motion: PlayedMotion) -> "CampaignRound":
        """With another record of the motion of that name."""
        motions = tuple(motion if each.name == motion.name else each for each in self.motions)
        return replace(self, motions=motions)


@dataclass(frozen=True, repr=False)
class Campaign(Shown):
    """All of it, as it is kept on disk after every step."""

    config: str
    config_folder: str
    fingerprint: str
    asked: CampaignOptions
    rounds: tuple[CampaignRound, ...] = ()
    ended: End = ""
    reason: str = ""
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def motions(self) -> tuple[PlayedMotion, ...]:
        """Every motion that is measured, in order."""
        return tuple(m for each in self.rounds for m in each.motions if m.data)

    @property
    def seconds(self) -> float:
        """How long the robot moved [s]."""
        return sum(each.seconds for each in self.motions)

    def with_round(self, last: CampaignRound) -> "Campaign":
        """With another record of the round of that number, or one more."""
        before = tuple(each for each in self.rounds if each.number != last.number)
        return replace(self, rounds=(*before, last))


# The folder of a campaign: one small file with its state, replaced as a whole after every step.

STATE = "campaign.json"
_ADAPTER = TypeAdapter(Campaign)


def read_campaign(folder: Path) -> Campaign:
    """The state of the campaign in `folder`.

    Raises
    ------
    FileError
        There is none, or its file is damaged.
    """
    path = folder / STATE
    try:
        return _ADAPTER.validate_json(path.read_bytes())
    except FileNotFoundError as error:
        raise FileError(
            f"{folder} holds no campaign: there is no {STATE}. Begin one without --resume."
        ) from error
    except OSError as error:
        raise FileError(f"{path} cannot be read: {refusal(error)}") from error
    except ValidationError as error:
        what = error.errors()[0]
        where = ".".join(map(str, what["loc"])) or "the file"
        raise FileError(
            f"{path} is not the state of a campaign: {where}: {what['msg']}. It is written whole "
            "or not at all: put back a copy of it, or begin in another folder."
        ) from error


def write_campaign(folder: Path, campaign: Campaign) -> None:
    """Replace the state of the campaign in `folder`, as a whole."""
    text = _ADAPTER.dump_json(campaign, indent=1).decode()
    write_text_atomically(folder / STATE, text + "\n")

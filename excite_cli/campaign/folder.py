"""The folder of a campaign: one small file with its state, replaced as a whole after every step."""

from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from excite_cli.atomic import write_text_atomically
from excite_cli.campaign.records import Campaign
from excite_cli.errors import FileError, refusal

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

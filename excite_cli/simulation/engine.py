"""MuJoCo, loaded where it is needed: it is an extra, and importing it takes a moment."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from excite_cli.errors import MissingExtraError


def load_mujoco() -> Any:
    """The module.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError(
            "Simulating needs MuJoCo, which is not installed. "
            "Install it with: pip install 'excite-cli[sim]'"
        ) from error
    return mujoco


@contextmanager
def silent_engine() -> Iterator[None]:
    """Within this context MuJoCo neither prints warnings nor writes MUJOCO_LOG.TXT.

    What they would tell is checked here, and told in our words.
    """
    mujoco = load_mujoco()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)

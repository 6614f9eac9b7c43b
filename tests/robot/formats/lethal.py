"""Formats whose libraries a file leads astray; imported by the process that reads them, too."""

import os
from pathlib import Path
from typing import ClassVar

import numpy as np

from excite_cli.errors import MissingExtraError
from excite_cli.robot.formats.base import ConversionRequest, RobotFormat, Urdf


class Lethal(RobotFormat):
    """Does what the file says."""

    name = "Lethal"
    foreign: ClassVar[bool] = True

    def recognises(self, path: Path, text: str) -> bool:
        return True

    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        if text == "abort":
            os.abort()
        if text == "run on":
            while True:
                pass
        if text == "grow":
            np.ones(2**33)
        if text == "missing":
            raise MissingExtraError("pip install something")
        print("a library's own words")
        Path("LOG.TXT").write_text("a library's log")
        return Urdf(text, ("folder",), ("a note",), (), (("a", "b"),))

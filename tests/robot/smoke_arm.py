"""The arm of the examples."""

from pathlib import Path

ARM = Path(__file__).parents[2] / "data" / "smoke_arm.urdf"

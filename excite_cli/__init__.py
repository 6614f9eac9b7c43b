"""excite: motions that make a robot's inertial parameters visible."""

__version__ = "0.1.0"

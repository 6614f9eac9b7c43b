"""The base of a robot that stands on the ground: wrenches that hold it, and how it moves."""

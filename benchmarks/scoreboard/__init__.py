"""A score board: one judge for several ways of finding the dynamics of a robot from its log."""

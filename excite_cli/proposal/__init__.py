"""A first config for a robot that nobody has described yet."""

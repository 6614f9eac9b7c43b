"""From measured data to parameters, with their standard deviations."""

"""From measured data to parameters, with what they are worth."""

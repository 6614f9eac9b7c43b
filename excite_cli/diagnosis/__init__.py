"""From the residual of the declared model to named effects, and to the next motion."""

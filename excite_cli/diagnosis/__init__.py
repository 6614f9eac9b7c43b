"""From what the declared model leaves over to named effects, and to the next motion."""

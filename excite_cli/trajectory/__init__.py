"""From coefficients to positions, speeds and accelerations."""

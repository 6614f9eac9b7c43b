"""Where torques come from: measured at the link or motor, or what the drive's law makes of them."""

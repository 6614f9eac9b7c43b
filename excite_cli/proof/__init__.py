"""What holds over whole intervals of time: Taylor models, bounds, the certificate."""

"""What quantities can be over whole intervals of time: Taylor models."""

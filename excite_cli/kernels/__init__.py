"""Inner loops in C, and how they are called."""

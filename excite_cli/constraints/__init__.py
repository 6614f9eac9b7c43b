"""What a motion must keep: margins and their gradients, one file for each kind."""

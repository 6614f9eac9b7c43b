"""The loop closed by itself: what was planned, measured and learned, and when it ends."""

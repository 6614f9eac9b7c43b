"""Parts of the battery of campaigns: robots, motions, instruments, what changes, judging, tables."""

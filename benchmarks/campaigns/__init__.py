"""Parts of the battery of campaigns: robots, motions, instruments, changes, judging, tables."""

"""Many cases: settings and logs, a file each, and one table."""

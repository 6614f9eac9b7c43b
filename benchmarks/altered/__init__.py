"""Parts of the table of altered logs: recordings, what is done to them, and how they are told."""

"""Records as tables, sentences and data: the same for terminals, notebooks and scripts."""

"""Parts of the diagnosis battery: robots and motions, cases, judging, scoring, tables."""

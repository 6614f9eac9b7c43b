"""What the library hands to whoever shows it: notes, tables, records; no terminal is known here."""

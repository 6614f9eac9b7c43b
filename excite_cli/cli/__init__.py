"""The program `excite`: one file for each command, tables, progress, exit statuses."""

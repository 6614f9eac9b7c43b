"""Stored models against new data: errors, alarms, reasons, thresholds, changes."""

"""The report on a recorded run: its numbers, tables, figures and words."""

"""Single tosses: maps of them, the best ones, their paths in time."""

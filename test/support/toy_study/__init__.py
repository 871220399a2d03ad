"""A study as somebody adds one: this folder, and a line in `executables.STUDIES`."""

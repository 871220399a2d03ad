"""Results in, figures out. Imported last: nothing else needs matplotlib."""

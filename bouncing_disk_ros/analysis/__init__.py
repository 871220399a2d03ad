"""Arrays in, results out: what the impacts of a run mean."""

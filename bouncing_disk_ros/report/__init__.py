"""The report on a recorded run: estimates, panels, figures, page."""

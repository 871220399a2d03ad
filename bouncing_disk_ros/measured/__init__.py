"""Models fitted to measured impacts: parameters with intervals, and what comes next."""

"""What controllers compute, compiled: flights over an offset, plans, strategies, loops."""

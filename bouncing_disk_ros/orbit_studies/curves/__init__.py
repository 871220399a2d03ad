"""The study curves."""

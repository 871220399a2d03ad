"""The study resilience."""

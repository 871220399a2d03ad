"""The study bifurcation."""

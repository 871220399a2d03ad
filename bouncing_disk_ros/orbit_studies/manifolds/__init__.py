"""The study manifolds."""

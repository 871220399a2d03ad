"""Proofs of what the core reports, in interval arithmetic and without its functions."""

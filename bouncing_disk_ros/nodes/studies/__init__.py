"""The studies as nodes: one file for each, and what makes any study an executable."""

"""The study parameter_map."""

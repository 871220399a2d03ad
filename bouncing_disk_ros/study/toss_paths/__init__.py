"""The study toss_paths."""

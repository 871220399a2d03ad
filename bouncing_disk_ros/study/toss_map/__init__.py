"""The study toss_map."""

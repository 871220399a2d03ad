"""The study basin_shares."""

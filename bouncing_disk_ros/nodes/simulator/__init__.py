"""The simulator as a node: commands in, states and impacts out."""

"""The recorder: topics into an MCAP bag."""

"""The executables: wiring only. Executable = module = default node name (but `bouncing_disk`)."""

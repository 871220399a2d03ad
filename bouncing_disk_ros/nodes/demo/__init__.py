"""The demonstration: a simulator, a performer and a recorder, started and watched."""

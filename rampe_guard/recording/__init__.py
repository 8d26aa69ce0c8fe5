"""Recordings: what a machine and its guard said, kept so that it can be replayed exactly."""

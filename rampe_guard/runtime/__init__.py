"""The shell around the core: Zenoh, the clock, the worker loop, replay."""

"""A simulated machine and a simulated operator, for the demo and for tests."""

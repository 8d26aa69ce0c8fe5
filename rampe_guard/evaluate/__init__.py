"""Scoring: which contacts were warned of, how early, and how often in vain."""

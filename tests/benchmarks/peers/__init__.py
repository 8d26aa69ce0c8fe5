"""The sweep beside its peers: same arms, scenes and motions, one process, one core."""

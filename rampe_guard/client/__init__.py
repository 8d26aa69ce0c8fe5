"""For those who build on the guard's alerts: who is guarded, what is raised, what was lost."""

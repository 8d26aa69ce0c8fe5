"""What each command does, one module a command: they put the other packages together."""

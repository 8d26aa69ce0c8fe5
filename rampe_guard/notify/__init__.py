"""Alerts carried to buzzers, relays and phones: a command, a URL, a sound.

`choose` says what is worth telling, `ledger` what one target still has to be told (both pure);
`command`, `post` and `sound` are the targets, `messenger` gives each a thread of its own.
"""

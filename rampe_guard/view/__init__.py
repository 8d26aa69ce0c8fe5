"""What people see: a terminal view of one machine, and the table that closes the demo.

`follow` turns messages into a `state.ViewState`, `screen.render` turns that into text.
Both are pure: whoever shows it brings the messages, the time and the terminal.
"""

"""What the controller is busy with, and how one thing follows the other: a declared state machine.

`transitions`: the table that is run. `conditions`: when its rows happen. `moves`: what is remembered and
forgotten with them. docs/behaviour.md shows the table.
"""

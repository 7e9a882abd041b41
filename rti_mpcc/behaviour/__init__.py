"""What the controller is busy with, and how one thing follows the other: a declared state machine.

`transitions`: the table that is run. `conditions`: when its rows happen. docs/behaviour.md shows the table.
"""

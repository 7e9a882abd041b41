"""Which solution is driven, and what is driven instead."""

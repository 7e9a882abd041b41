"""What is driven in a cycle: a plan, the fallback, or a hold, within the limits."""

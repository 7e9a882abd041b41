"""Where the vehicle is to drive: segments, their targets, where they end, and other routes."""

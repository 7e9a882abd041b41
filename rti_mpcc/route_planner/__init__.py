"""The route planner: from a start and a goal in an area to a manoeuvre (start, goal, area -> manoeuvre)."""

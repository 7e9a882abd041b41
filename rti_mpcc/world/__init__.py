"""What is known in a cycle: the vehicle, its goal and its surroundings, by what is measured and commanded."""

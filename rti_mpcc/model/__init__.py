"""The vehicle: kinematic bicycle, its discretisation, the body's discs, queued commands."""

"""The vehicle: kinematic bicycle, its discretisation, the body's boxes, queued commands."""

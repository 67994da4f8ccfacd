"""Import of robot descriptions (URDF, xacro, MJCF) as robot models."""

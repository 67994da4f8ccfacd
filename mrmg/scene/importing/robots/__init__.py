"""Import of robot descriptions (URDF, xacro, MJCF) as robot models."""

from mrmg.scene.importing.robots.importing import ImportedRobot, import_robot

__all__ = ["ImportedRobot", "import_robot"]

"""Making scenes and robots: new ones, foreign maps, and missions placed on maps."""

from mrmg.authoring.importing import import_map
from mrmg.authoring.new_robot import new_robot
from mrmg.authoring.new_scene import new_scene
from mrmg.authoring.populate import populate

__all__ = ["import_map", "new_robot", "new_scene", "populate"]

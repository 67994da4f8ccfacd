"""Reading scene files: strict, and with every fault of a file reported at once.

The format is documented in `scene.loading.schema`.
"""

from mrmg.scene.loading.hints import heading_hints
from mrmg.scene.loading.json_schema import robot_schema, scene_schema
from mrmg.scene.loading.reading import dump_scene, load_scene, scene_from_document

__all__ = [
    "dump_scene",
    "heading_hints",
    "load_scene",
    "robot_schema",
    "scene_from_document",
    "scene_schema",
]

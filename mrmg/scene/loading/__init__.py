"""Reading scene files: strict, and with every fault of a file reported at once.

The format is documented in `scene.loading.schema`.
"""

from mrmg.scene.loading.reading import dump_scene, load_scene, scene_from_document

__all__ = ["dump_scene", "load_scene", "scene_from_document"]

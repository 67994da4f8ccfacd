"""Import of maps, layouts and robots from other sources as scene documents."""

from mrmg.scene.importing.importing import import_files, import_map

__all__ = ["import_files", "import_map"]

"""Import of maps from other sources as scene documents."""

from mrmg.scene.importing.importing import import_map

__all__ = ["import_map"]

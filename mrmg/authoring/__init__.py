"""Making scenes: reading foreign maps, and populating maps with missions."""

from mrmg.authoring.importing import import_map
from mrmg.authoring.populate import populate

__all__ = ["import_map", "populate"]

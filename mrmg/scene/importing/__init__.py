"""Import of maps, layouts and robots from other sources as scene documents."""

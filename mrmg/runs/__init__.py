"""A run from arguments to results: pipeline, steps, run folder, capsule, summary."""

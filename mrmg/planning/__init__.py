"""From a scene to a plan: roadmap, router, motion tree."""

"""Pictures, videos and viewers of scenes, plans and simulated drives."""

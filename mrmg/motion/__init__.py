"""How robots move."""

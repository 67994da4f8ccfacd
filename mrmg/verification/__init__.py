"""Verification of plans from the scene alone: rules, clearances and the verdict."""

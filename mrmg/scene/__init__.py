"""The problem statement: types, loading, robot models."""

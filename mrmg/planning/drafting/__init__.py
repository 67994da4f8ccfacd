"""Plans without a tree, and better ones from those there are.

A path is drawn tight (`band`) and driven in closed loop (`tracking`); `drafting` does
so along tours, `refine` along a plan; `encounters` and what it uses lead robots past
each other.
"""

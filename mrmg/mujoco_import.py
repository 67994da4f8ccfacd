"""The one place where MuJoCo is imported: its children do not see Ctrl-C.

MuJoCo imports glfw, which asks small Python processes for its libraries' versions. A
Ctrl-C at a terminal reaches them, too, and they would print a traceback.
"""

from mrmg.interruption import sheltered_children

with sheltered_children():
    import mujoco

__all__ = ["mujoco"]

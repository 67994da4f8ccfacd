"""The one place where MuJoCo is imported: its children do not see Ctrl-C.

MuJoCo imports glfw, which asks small Python processes for its libraries' versions. A
Ctrl-C at a terminal reaches them, too, and they would print a traceback.

It also imports the OpenGL that `MUJOCO_GL` names. Where that is missing it is imported
without: only drawing needs one, and chooses another.
"""

import os
import sys

from mrmg.interruption import sheltered_children

with sheltered_children():
    try:
        import mujoco
    except Exception:
        from unittest import mock

        for name in [*sys.modules]:
            if name.partition(".")[0] == "OpenGL":  # bound to what is missing
                del sys.modules[name]
        with mock.patch.dict(os.environ, MUJOCO_GL=""):
            import mujoco

__all__ = ["mujoco"]

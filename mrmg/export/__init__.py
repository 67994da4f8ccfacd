"""Plans and drives in the formats of other tools: ROS 2, fleet managers, GIS, tables.

`exporting.export_run` writes a run; every format is one module of `formats`, under the
name of its file.
"""

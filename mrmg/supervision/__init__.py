"""Above planning and execution: stops a driving fleet and plans the rest anew.

`driving.drive_mission` drives a plan under control, `remaining.remaining_scene` states
what is left.
"""

"""From a plan to a log: the MuJoCo world, controllers, simulation.

`simulation.simulate` drives a plan, `world_model.build_world` compiles a scene,
`log.ExecutionLog` is the record.
"""

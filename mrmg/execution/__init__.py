"""From a plan to a log: the MuJoCo world, controllers, simulation."""

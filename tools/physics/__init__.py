"""The parts of `tools/bench_physics`: missions, yaw rates, trials, and the figures."""

"""mrmg: mission planning for fleets of energy-limited robots, executed in MuJoCo."""

__version__ = "0.1.0"

"""Trials of every combination of scenes, seeds, methods, plants and disturbances.

`read_campaign` reads a campaign file (`schema` documents the format), `run_campaign`
makes its trials and the tables and the page of what they come to.
"""

from mrmg.studies.campaigns.campaign import run_campaign
from mrmg.studies.campaigns.reading import read_campaign

__all__ = ["read_campaign", "run_campaign"]

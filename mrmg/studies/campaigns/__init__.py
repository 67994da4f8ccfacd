"""Trials of every combination of scenes, seeds, methods, plants and disturbances.

`reading` reads a campaign file (`schema` documents the format), `campaign.run_campaign`
makes its trials and the tables and the page of what they come to.
"""

"""Judging and showing: verification, audit, summary, pictures, report."""

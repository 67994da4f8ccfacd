"""Pages of HTML: the report of a run, and the comparison of runs."""

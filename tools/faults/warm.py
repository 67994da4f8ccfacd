"""What a process that commands are forked from has imported, compiled and loaded."""

import contextlib
import io
import os
import tempfile
from pathlib import Path

from faults import kills  # noqa: F401 (and all that its children import)
from faults.runs import SITE
from mrmg.cli.main import main

with (
    tempfile.TemporaryDirectory() as place,
    contextlib.chdir(place),
    contextlib.redirect_stdout(io.StringIO()),
    contextlib.redirect_stderr(io.StringIO()),
):
    Path("site.yaml").write_text(SITE)
    Path("campaign.yaml").write_text("scenes: [site.yaml]\n")
    main(["run", "site.yaml", "--no-video", "--out", "out"])
    main(["robustness", "out", "--trials", "1"])
    main(["campaign", "campaign.yaml", "--out", "made"])
    os.sync()

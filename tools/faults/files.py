"""Damaged files of all formats that are read: each ends in one message and a code."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from random import Random

from protocol import Row

from faults.commands import Commands, Outcome, left_over, run_process
from faults.corpus import make_corpus
from faults.mutations import mutated
from faults.named import run_cases
from faults.review import REVIEW
from faults.rows import Options, row_of
from faults.sources import Source

CHUNK = 250
"""Files that make one trial, which an interruption does not lose."""

PROCESS_SHARE = 100
"""One of so many commands is run as a process of its own, too."""

REQUIRED = (
    "no traceback, hang > 5 s or memory > 1 GB; documented exit code, one message"
)


def rows(options: Options) -> Iterator[Row]:
    """Yield a row for the files of the review, and one for each format."""
    corpus = make_corpus(options.work / "corpus")
    formats = list(dict.fromkeys(source.format for source in corpus))
    found = options.trials.row(
        lambda: run_cases(REVIEW, options.work / "review"),
        part="files",
        format="review",
    )
    yield row_of("files: review", REQUIRED, found["cases"], found["failures"])
    share = max(1, options.files // len(formats))
    for number, format in enumerate(formats):
        rest = options.files - share * len(formats) if number == 0 else 0
        yield _row_of_format(options, corpus, format, share + max(0, rest))


def _row_of_format(
    options: Options, corpus: list[Source], format: str, count: int
) -> Row:
    sources = [source for source in corpus if source.format == format]
    failures: list[Row] = []
    codes: dict[str, int] = defaultdict(int)
    worst = {"cpu_s": 0.0, "peak_bytes": 0}
    for first in range(0, count, CHUNK):
        numbers = range(first, min(count, first + CHUNK))
        found = options.trials.row(
            lambda numbers=numbers: _chunk(options, sources, numbers),  # type: ignore[misc]
            part="files",
            format=format,
            numbers=[numbers.start, numbers.stop],
        )
        failures += found["failures"]
        for code, number in found["codes"].items():
            codes[code] += number
        worst = {key: max(value, found[key]) for key, value in worst.items()}
    return row_of(
        f"files: {format}", REQUIRED, count, failures, codes=dict(codes), **worst
    )


def _chunk(options: Options, sources: list[Source], numbers: range) -> Row:
    commands = Commands()
    failures, codes = [], defaultdict(int)
    cpu_s, peak_bytes = 0.0, 0
    try:
        for number in numbers:
            random = Random(f"{options.seed} {sources[0].format} {number}")
            source = random.choice(sources)
            words = random.choice(source.commands)
            place = _copy(source.folder, options.work / "case")
            file = place / source.name
            file.write_bytes(mutated(source.name, file.read_bytes(), random))
            before = {path for path in place.rglob("*")}
            damaged = file.read_bytes()
            outcome = commands.run(place, words)
            fault = outcome.fault() or left_over(place, before, outcome)
            if not fault and random.randrange(PROCESS_SHARE) == 0:
                fault = _fault_of_process(source, damaged, words, options, outcome)
            codes[str(outcome.code)] += 1
            cpu_s = max(cpu_s, outcome.cpu_s)
            peak_bytes = max(peak_bytes, outcome.peak_bytes)
            if fault:
                case = f"{sources[0].format} {number}: {' '.join(words)}"
                row = {"case": case, "file": source.name, "fault": fault}
                failures.append(row)
                _keep(options, row, place, damaged, outcome)
    finally:
        commands.close()
    return {
        "failures": failures,
        "codes": dict(codes),
        "cpu_s": cpu_s,
        "peak_bytes": peak_bytes,
    }


def _copy(folder: Path, place: Path) -> Path:
    shutil.rmtree(place, ignore_errors=True)
    return Path(shutil.copytree(folder, place))


def _fault_of_process(
    source: Source,
    damaged: bytes,
    words: tuple[str, ...],
    options: Options,
    inside: Outcome,
) -> str:
    place = _copy(source.folder, options.work / "case")
    (place / source.name).write_bytes(damaged)
    outcome = run_process(place, words)
    if outcome.code != inside.code:
        return f"exit code {outcome.code} as a process of its own, {inside.code} inside"
    return outcome.fault()


def _keep(
    options: Options, row: Row, place: Path, damaged: bytes, outcome: Outcome
) -> None:
    if options.keep is None:
        return
    name = row["case"].partition(":")[0].replace(" ", "-")
    folder = options.keep / name
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(place, folder / "files", dirs_exist_ok=True)
    (folder / "files" / row["file"]).write_bytes(damaged)
    text = f"{row['case']}\n{row['fault']}\n{outcome.err}\n{outcome.trace}\n"
    (folder / "outcome.txt").write_text(text)

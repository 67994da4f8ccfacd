"""Campaign files: every combination of their factors, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest

from mrmg.errors import ExitCode, FileError
from mrmg.studies.campaigns.reading import read_campaign
from mrmg.studies.campaigns.schema import CampaignDocument, campaign_schema

ZOO = Path(__file__).parent / "bad"
FILES = sorted(path.name for path in ZOO.glob("*.yaml"))


@pytest.mark.parametrize("name", FILES)
def test_message(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ZOO)
    with pytest.raises(FileError) as caught:
        read_campaign(Path(name))
    assert f"{caught.value}\n" == (ZOO / name).with_suffix(".txt").read_text()
    assert caught.value.exit_code == ExitCode.INVALID_FILE


def test_there_is_a_trial_for_every_combination(tmp_path: Path) -> None:
    file = tmp_path / "sweep.yaml"
    file.write_text(
        "scenes: [quickstart, scene1]\nseeds: 3-5\nrouters: [default, exact]\n"
        "disturbances: [none, default, rolling=+30%]\n"
        "parameters: {soc_margin: [0, 0.2], battery.capacity_m: [300, 400]}\n"
    )
    trials = read_campaign(file).trials
    assert len(trials) == 2 * 3 * 2 * 3 * 2 * 2
    assert len({trial.key for trial in trials}) == len(trials)
    arguments = [trial.order.arguments for trial in trials]
    assert {each.seed for each in arguments} == {3, 4, 5}
    assert all(each.seed == each.disturb_seed for each in arguments)
    assert {each.disturb for each in arguments} == {None, "", "rolling=+30%"}
    assert {each.router for each in arguments} == {None, "exact"}
    first = trials[0]
    assert first.order.changes == {"battery": {"capacity_m": 300}}
    assert first.factors["battery.capacity_m"] == 300


def test_a_trial_keeps_its_key_in_a_larger_campaign(tmp_path: Path) -> None:
    file = tmp_path / "sweep.yaml"
    file.write_text(
        "scenes: {scene: quickstart, name: other, populate: {goals: 3}}\nseeds: 4-5\n"
    )
    few = {trial.key for trial in read_campaign(file).trials}
    file.write_text(
        "scenes: [{scene: quickstart, name: other, populate: {goals: 3}}, scene1]\n"
        "seeds: 0-7\nplants: [scrub, default]\n"
    )
    many = {trial.key for trial in read_campaign(file).trials}
    assert len(few) == 2
    assert few < many


def test_the_schema_for_editors_takes_what_is_read() -> None:
    schema = campaign_schema()
    validator = jsonschema.validators.validator_for(schema)
    validator.check_schema(schema)
    good = [
        {"scenes": "quickstart", "seeds": "0-3", "plants": ["default", "scrub"]},
        {"scenes": ["a.yaml", {"scene": "b", "perturb": {"goals": 1}}], "seeds": [1]},
        {"scenes": "a", "parameters": {"soc_margin": 0.1, "replan": [True, False]}},
    ]
    bad = [{"seeds": 1}, {"scenes": "a", "planner": "x"}, {"scenes": {"name": "a"}}]
    assert [validator(schema).is_valid(each) for each in good] == [True] * 3
    assert [validator(schema).is_valid(each) for each in bad] == [False] * 3
    for each in good:
        CampaignDocument.model_validate(each)


def test_an_unknown_parameter_is_refused_with_those_there_are(tmp_path: Path) -> None:
    file = tmp_path / "sweep.yaml"
    file.write_text("scenes: quickstart\nparameters: {sock_margin: 1}\n")
    with pytest.raises(
        FileError, match=r"line 2: .*did you mean 'soc_margin'"
    ) as caught:
        read_campaign(file)
    assert all(name in str(caught.value) for name in ("budget_s", "replan", "battery"))

from __future__ import annotations

import json
import os
from importlib.metadata import PackageMetadata, PackageNotFoundError
from pathlib import Path

import pytest

from mrmg import doctor, licences
from mrmg.cli.main import main
from mrmg.errors import ExitCode


def test_everything_needed_is_looked_at() -> None:
    names = {finding.name for finding in doctor.examine()}
    assert {"python", "cpu", "kernel cache", "offscreen GL"} <= names
    assert {"mujoco", "casadi", "numba", "shapely", "trimesh", "networkx"} <= names
    assert not {"pytest", "ruff", "mypy"} & names


def test_the_command_tells_the_findings_as_json(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code = main(["doctor", "--json"])
    findings = json.loads(capsys.readouterr().out)
    missing = [finding for finding in findings if not finding["ok"]]
    assert code == (ExitCode.MACHINE if missing else ExitCode.OK)
    assert all(finding["remedy"] for finding in missing)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_cache_that_cannot_be_written_is_told_with_its_cure(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tmp_path.chmod(0o500)
    monkeypatch.setattr("mrmg.compilation.cache_folder", lambda: tmp_path / "kernels")
    finding = doctor._kernel_cache()
    assert not finding.ok
    assert "NUMBA_CACHE_DIR" in finding.remedy


@pytest.mark.parametrize("name", ["shapely", "mujoco"])
def test_a_missing_package_is_told_with_its_cure(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The package's record is hidden; all else that is looked at is real."""
    real = licences.metadata

    def hidden(asked: str) -> PackageMetadata:
        if asked == name:
            raise PackageNotFoundError(asked)
        return real(asked)

    monkeypatch.setattr(licences, "metadata", hidden)
    assert main(["doctor"]) == ExitCode.MACHINE
    output = capsys.readouterr().out
    assert "MISSING" in output
    assert f"pip install {name}" in output


def test_licences_of_all_dependencies_are_listed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["doctor", "--licences", "--json"]) == ExitCode.OK
    found = {each["package"]: each for each in json.loads(capsys.readouterr().out)}
    required = {name for name, each in found.items() if "mrmg" in each["required_by"]}
    looked_at = {finding.name for finding in doctor.examine()}
    assert looked_at >= {name for name in required if not found[name]["extra"]}
    assert "LGPL" in found["casadi"]["licence"]
    assert "numba" in found["llvmlite"]["required_by"]
    assert found["viser"]["extra"] == "view"
    assert all(each["licence"] for each in found.values() if each["version"])
    assert not {"pytest", "ruff"} & {*found}
    assert main(["doctor", "--licences"]) == ExitCode.OK
    header, *rows = capsys.readouterr().out.splitlines()
    assert header.split() == ["package", "version", "licence", "extra"]
    assert len(rows) == len(found)


def test_licences_of_what_extras_of_dependencies_bring(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A package may be required without an extra first, and with it then."""
    requirements = {
        "mrmg": ["alpha", "zeta"],
        "alpha": ["beta[all]", "gone"],
        "zeta": ["beta", "gone"],
        "beta": ["beta[fast]; extra == 'all'", "gamma; extra == 'fast'"],
    }
    for name, required in requirements.items():
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        lines = [f"Name: {name}", "Version: 1.0", "License: MIT"]
        lines += [f"Requires-Dist: {line}" for line in required]
        (folder / "METADATA").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["doctor", "--licences", "--json"]) == ExitCode.OK
    found = {each["package"]: each for each in json.loads(capsys.readouterr().out)}
    assert [*found] == ["alpha", "beta", "gamma", "gone", "zeta"]
    assert found["beta"]["required_by"] == ["alpha", "zeta"]
    assert found["gamma"]["required_by"] == ["beta"]
    assert found["gone"]["required_by"] == ["alpha", "zeta"]

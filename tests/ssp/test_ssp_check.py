"""Checking SSP archives: a right system that uses most of the standard, and wrong ones, each with all its findings."""

from __future__ import annotations

import copy
import io
import random
import zipfile

import pytest
from command_line import typed
from lxml import etree
from right_system import BUS, COMMON, GAINS, MAPPING, RIGHT, SET, SSD, expected, save, system_files, wrong_files
from wrong_systems import WRONG

from shaper_fmu.ssp.check import check_files, check_ssp
from shaper_fmu.ssp.schemas import schema_problems


@pytest.fixture(scope="module")
def right(fmus) -> dict[str, bytes]:
    return system_files(fmus)


def test_the_right_system_is_right(right, tmp_path):
    """By the schemas, and by what they cannot see."""
    assert [problem for name, text in RIGHT.items() for problem in schema_problems(text.encode(), name)] == []
    assert check_ssp(save(right, tmp_path / "right.ssp")) == []


@pytest.mark.parametrize("name", WRONG)
def test_wrong_systems_are_told_with_file_and_line(right, name):
    """All findings and no others, in the order of files and lines."""
    files = wrong_files(WRONG[name], right)
    assert check_files(files) == expected(WRONG[name], files)


def test_there_are_more_than_forty_of_which_most_are_valid_for_the_schemas(right):
    texts = (SSD, COMMON, GAINS, MAPPING, BUS, SET)
    found = {name for name, wrong in WRONG.items() if any(schema_problems(wrong_files(wrong, right)[text], text) for text in texts)}
    assert found == {name for name, wrong in WRONG.items() if wrong.seen_by_schema}
    assert len(WRONG) >= 40
    assert len(WRONG) - len(found) >= 15


def test_the_command_prints_every_finding_and_exits_with_one(right, tmp_path):
    name = "four at once"
    files = wrong_files(WRONG[name], right)
    save(files, tmp_path / "wrong.ssp")
    save(right, tmp_path / "right.ssp")
    (tmp_path / "empty.ssp").write_bytes(b"")
    done = typed("check", "right.ssp", "wrong.ssp", "empty.ssp", cwd=tmp_path)
    *lines, empty = done.stdout.splitlines()
    assert (done.returncode, done.stderr) == (1, "")
    notes = ("", "note: ")  # a declared type is the FMU's business, and a value that nothing takes is ignored
    stops = ("comand" in one or "soon" in one for one in expected(WRONG[name], files))
    assert lines == [f"wrong.ssp: {notes[not stop]}{one}" for stop, one in zip(stops, expected(WRONG[name], files), strict=True)]
    assert empty.startswith("empty.ssp: empty.ssp: not a readable archive")
    again = typed("check", "right.ssp", cwd=tmp_path)
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")
    portable = typed("check", "--portable", "right.ssp", cwd=tmp_path)
    assert portable.returncode == 1
    assert "line 8: a nested system (command): libcosim and ecos refuse the archive" in portable.stdout


def test_a_step_that_does_not_divide_the_run_is_told_where_an_fmu_takes_no_other(right, tmp_path):
    """As `run` refuses it; the FMU's own words for it are taken away."""
    files = dict(right)
    plant = next(name for name in files if name.endswith("MassSpringDamper.fmu"))
    content = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(files[plant])) as old, zipfile.ZipFile(content, "w") as new:
        for entry in old.infolist():
            text = old.read(entry)
            new.writestr(entry, text.replace(b'canHandleVariableCommunicationStepSize="true"', b""))
    files[plant] = content.getvalue()
    assert check_ssp(save(files, tmp_path / "whole.ssp")) == []
    files[SSD] = files[SSD].replace(b'stopTime="5"', b'stopTime="5.005"')
    told = check_ssp(save(files, tmp_path / "broken.ssp"))
    assert told == ["default experiment: plant takes no variable steps, so stop_time must be a multiple of the step 0.01 s"]


def changed_at_random(files: dict[str, bytes], chance: random.Random) -> dict[str, bytes]:
    """The right system with an element or attribute taken away, doubled, moved, renamed or given another value, in one to three places."""
    changed = dict(files)
    for _ in range(chance.randint(1, 3)):
        name = chance.choice(list(RIGHT))
        root = etree.fromstring(changed[name])
        nodes = list(root.iter(etree.Element))  # pyright: ignore[reportArgumentType]
        node, other = chance.choice(nodes), chance.choice(nodes)
        parent = node.getparent()
        match chance.randint(0, 4):
            case 0 if parent is not None:
                parent.remove(node)
            case 1 if parent is not None:
                parent.append(copy.deepcopy(node))
            case 2 if node.attrib:
                node.attrib.pop(chance.choice(list(node.attrib)))
            case 3 if node.attrib:
                values = ["", "-1", "nan", "1e999", "http://x/y", "../z", "input", "plant", "é", *other.attrib.values()]
                node.set(chance.choice(list(node.attrib)), chance.choice(values))
            case 4:
                node.tag = other.tag
        changed[name] = etree.tostring(root)
    return changed


def test_whatever_is_wrong_is_told_and_what_is_not_can_be_loaded(right, tmp_path):
    """The check never fails, and its silence means that our master takes the system."""
    chance, silent = random.Random(20090), 0
    for _ in range(250):
        files = changed_at_random(right, chance)
        if not check_files(files):
            silent += 1
            assert check_ssp(save(files, tmp_path / "changed.ssp")) == []
    assert 10 < silent < 125

"""Power cuts and kills are tried on every command that writes a file or a folder, and on every target."""

from jobs import LINE_BY_LINE, TARGETS, jobs_in

from dzdesign.codegen.other_targets import OTHER_TARGETS
from dzdesign.codegen.project import TARGET_NAMES
from dzdesign.command_line.command_table import COMMANDS
from dzdesign.command_line.parser import arguments_of_command


def test_every_command_that_writes_has_a_job(tmp_path):
    writing = {name for name in COMMANDS if any(each.name == "output" for each in arguments_of_command(name))}
    jobs = jobs_in(tmp_path)
    assert {job.new[0] for job in jobs} == (writing | {"demo"}) - set(LINE_BY_LINE)
    assert set(LINE_BY_LINE) <= writing and len({job.name for job in jobs}) == len(jobs)


def test_every_target_has_a_job(tmp_path):
    assert set(TARGETS) == {*TARGET_NAMES, *OTHER_TARGETS}
    assert {f"codegen {target}" for target in TARGETS} <= {job.name for job in jobs_in(tmp_path)}

"""Which processors' machine code is tried: the target's own at least, others where their tools are there."""

from types import SimpleNamespace

import pytest

from dzdesign.verify.exhaustive import machine_code
from dzdesign.verify.toolchain.machines import Machine


@pytest.mark.parametrize(
    ("target", "tried"), [("cortex-m4", ["Cortex-M4"]), ("f28335", ["Cortex-M4", "AVR"])]
)
def test_without_tools_the_targets_own_machine_alone_is_required(tmp_path, monkeypatch, target, tried):
    monkeypatch.setattr(machine_code, "read_compensator", lambda _: SimpleNamespace(current_drive=None))
    monkeypatch.setattr(machine_code, "read_firmware_manifest", lambda _: SimpleNamespace(target=target))
    monkeypatch.setattr(Machine, "missing", lambda _: "no tools")
    (tmp_path / "manifest.json").touch()
    checks = machine_code.machine_code_checks(tmp_path, inputs=())
    assert [check.name.removeprefix("machine code of the ") for check in checks] == tried
    assert all(check.holds is None for check in checks)
    monkeypatch.setattr(Machine, "missing", lambda _: "")
    assert len(machine_code.machine_code_checks(tmp_path, inputs=())) == 2, "others are tried where they can be"

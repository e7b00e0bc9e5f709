"""What the README says that a check of a block takes, counted again."""

from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.f28335.target import CHECK_INSTRUCTIONS
from dzdesign.verify.toolchain.machines import CORTEX_M4
from tests.codegen.calibration.test_check import forms
from tests.support.core_texts import texts
from tests.support.loading.device import firmware_files
from tests.support.paths import TESTS


def counted(built, block) -> int:
    files = texts(block_core_files(built))
    core = {name: files[name].encode() for name in ("dz_calibration.c", "dz_calibration.h")}
    program = (TESTS / "support" / "check_cost.c").read_bytes()
    octets = ",".join(map(str, pack(block))).encode()
    sources = {**core, "check_cost.c": program, "octets.h": octets, **CORTEX_M4.headers}
    what = "the cost of the check"
    objects = [
        CORTEX_M4.compile("dz_calibration.c", core, CORTEX_M4.core_flags, what),
        CORTEX_M4.compile("check_cost.c", sources, CORTEX_M4.check_flags, what),
    ]
    *runner, kernel = CORTEX_M4.runner
    counting = replace(CORTEX_M4, runner=(*runner, "-icount", "shift=10", kernel))
    ((found, count),) = counting.run(CORTEX_M4.link(objects, what), [], what)
    assert found == 0
    return count


@pytest.mark.slow
@pytest.mark.skipif(bool(CORTEX_M4.missing()), reason=f"{CORTEX_M4.name}: {CORTEX_M4.missing()}")
def test_the_readme_states_the_instructions_of_the_longest_check():
    counts = {name: counted(built, block) for name, built, block in forms()}
    assert CHECK_INSTRUCTIONS - 200 < max(counts.values()) <= CHECK_INSTRUCTIONS, counts


def test_no_check_of_a_block_at_the_start_is_watched_by_the_watchdog():
    main = firmware_files()["main.c"]
    assert main.index("InitSysCtrl()") < main.index("dz_load_init(") < main.index("dz_watchdog_start()")
    loop = main[main.index("for (;;)") :]
    assert loop.index("service_watchdog_if_isr_ran();") < loop.index("dz_telemetry_poll();")

"""The stages as functions for notebooks and scripts: `identify`, `design`, `generate`, `verify` and their companions.

Each function takes paths or the result of the previous stage. Options are written as on the command line, such as
"1 MPa" or "0.1 s", and go before those of an options file in ``config``. The result is a frozen dataclass, which
`print` summarises and a notebook shows as a table. With ``output`` a function also writes the file or folder of the
command of the same stage, byte for byte. Nothing is printed, and heavy packages are imported when a stage is called.

`run` is the whole chain with one options file. `init`, `simulate`, `assess`, `report`, `batch` and `calibration`
correspond to the commands of the same names;
`read_calibration` corresponds to `calibration --read`.

>>> from dzdesign import api
>>> valve = api.identify("ramps/*.csv", meter_lag="0.1 s")         # doctest: +SKIP
>>> compensator = api.design(valve, target="f28335")               # doctest: +SKIP
>>> firmware = api.generate(compensator, output="firmware")        # doctest: +SKIP
>>> api.verify(firmware).holds                                     # doctest: +SKIP
True
"""

from dzdesign.batch.arguments import BatchArguments
from dzdesign.core.display import display_by
from dzdesign.core.errors import DzdesignError, InputError, RequirementError
from dzdesign.keywords import with_keywords
from dzdesign.stages import assess as assess_stage
from dzdesign.stages import batch as batch_stage
from dzdesign.stages import calibration as calibration_stage
from dzdesign.stages import design as design_stage
from dzdesign.stages import generate as generate_stage
from dzdesign.stages import identify as identify_stage
from dzdesign.stages import init as init_stage
from dzdesign.stages import report as report_stage
from dzdesign.stages import run as run_stage
from dzdesign.stages import simulate as simulate_stage
from dzdesign.stages import verify as verify_stage
from dzdesign.terminal.notebook import heading_of, html_of, text_of

__all__ = [
    "DzdesignError", "InputError", "RequirementError",
    "assess", "batch", "calibration", "design", "generate", "identify", "init", "read_calibration",
    "report", "run", "simulate", "verify",
]  # fmt: skip


def __dir__() -> list[str]:
    """Return the public names only, for the completion of an editor or a notebook."""
    return sorted(__all__)


display_by(heading=heading_of, text=text_of, html=html_of)

init = with_keywords(init_stage.InitArguments, init_stage.init, "init")
run = with_keywords(run_stage.RunArguments, run_stage.run)
identify = with_keywords(identify_stage.IdentifyArguments, identify_stage.identify, "identify")
design = with_keywords(design_stage.DesignArguments, design_stage.design, "design")
generate = with_keywords(generate_stage.GenerateArguments, generate_stage.generate, "codegen")
calibration = with_keywords(calibration_stage.CalibrationArguments, calibration_stage.calibration, "calibration")
read_calibration = with_keywords(calibration_stage.ReadCalibrationArguments, calibration_stage.read_calibration)
verify = with_keywords(verify_stage.VerifyArguments, verify_stage.verify, "verify")
simulate = with_keywords(simulate_stage.SimulateArguments, simulate_stage.simulate, "simulate")
assess = with_keywords(assess_stage.AssessArguments, assess_stage.assess, "assess")
report = with_keywords(report_stage.ReportArguments, report_stage.report, "report")
batch = with_keywords(BatchArguments, batch_stage.batch, "batch")

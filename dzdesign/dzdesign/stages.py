"""Each stage once: its arguments in, its typed result out, and the files written that the arguments name.

Commands, `dzdesign.api`, demo, batch and the paper's reproduction call these. What is heavy is imported when a stage is
called. Progress goes to `dzdesign.terminal.progress`, which is as quiet as the caller asked for.
"""

import os
from collections.abc import Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from dzdesign.arguments.firmware import (
    DesignArguments,
    GenerateArguments,
    SimulateArguments,
    VerifyArguments,
)
from dzdesign.arguments.recordings import AssessArguments, IdentifyArguments, IdentifyChoices, RampArguments
from dzdesign.core.artefact_files import (
    TOOL,
    check_file_may_be_written,
    check_folder_may_be_written,
    check_place_of_files,
    parse_document,
    read_bytes,
    sha256_of,
    to_json,
    write_file,
    write_files,
    write_folder,
)
from dzdesign.core.errors import InputError

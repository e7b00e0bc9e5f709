"""The file of a recording, written as it comes: whatever ends it, what was recorded until a second before is there."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from dzdesign.core.artefact_files import note_written
from dzdesign.core.disk_sync import sync_folder
from dzdesign.core.errors import InputError
from dzdesign.core.input_files import reason_of

#: What is older than this is on the disk, if the power goes.
SYNC_S = 1.0


class RecordingFile:
    """Whole lines, handed to the system at once and to the disk every second.

    The file is made at once, and none that exists is taken: another recording may be under way into it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        #: Octets of the whole lines in the file.
        self.octets = 0
        self._synced = 0.0
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | BINARY, 0o666)
        except FileExistsError as error:
            raise InputError(
                f"'{path}' exists, and a recording is not to be had again; choose another name with -o"
            ) from error
        except OSError as error:
            raise InputError(f"'{path}' can't be written: {reason_of(error)}") from error

    def write(self, lines: str) -> None:
        """Append whole lines, or none; what came a second before reaches the disk.

        Raises
        ------
        InputError
            If they can't be written, as on a full disk; the file then ends with the last line that was whole.
        """
        data, done = lines.encode(), 0
        try:
            if data and not self.octets:
                note_written(self.path)
                sync_folder(self.path.parent)
            while done < len(data):
                done += os.write(self._descriptor, data[done:])
            self.octets += len(data)
            self._sync()
        except OSError as error:
            self._end_with_a_whole_line(data[:done])
            raise InputError(f"'{self.path}' can't be written: {reason_of(error)}") from error

    def _sync(self) -> None:
        """Wait until all is on the disk, if the last time is a second ago."""
        now = time.monotonic()
        if now - self._synced >= SYNC_S:
            os.fsync(self._descriptor)
            self._synced = now

    def close(self) -> None:
        """Sync and close the file; one into which nothing came goes again."""
        with contextlib.suppress(OSError):  # a full disk, which was said
            os.fsync(self._descriptor)
        os.close(self._descriptor)
        if not self.octets:
            self.path.unlink(missing_ok=True)

    def _end_with_a_whole_line(self, last: bytes) -> None:
        self.octets += last.rfind(b"\n") + 1
        with contextlib.suppress(OSError):
            os.ftruncate(self._descriptor, self.octets)


#: Windows writes CR before each line feed otherwise.
BINARY = getattr(os, "O_BINARY", 0)


@contextlib.contextmanager
def recording_file(path: Path) -> Iterator[RecordingFile]:
    """Give the file of a recording, which is closed at the end of the context."""
    file = RecordingFile(path)
    try:
        yield file
    finally:
        file.close()

"""A serial port of this machine, opened for one program alone."""

import errno
import sys
import time
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError, RequirementError

if TYPE_CHECKING:
    import serial


#: The longest that a write may wait for the port.
WRITE_S = 1.0


def open_port(name: str, baud: float, look_s: float) -> "serial.Serial":
    """Open a serial port whose reads take at most `look_s`, or say in one sentence why not."""
    import serial
    from serial.tools import list_ports

    try:
        alone = {"exclusive": True} if sys.platform != "win32" else {}  # Windows knows nothing else
        port = serial.Serial(None, int(baud), timeout=look_s, write_timeout=WRITE_S, **alone)
        port.dtr = port.rts = False  # on many boards they are wired to reset and boot mode: opening would restart it
        port.port = name
        port.open()
        return port
    except (OSError, ValueError) as error:
        known = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        raise InputError(
            f"the port '{name}' can't be opened at {baud:g} bit/s: {_reason(error)}; ports of this machine: {known}"
        ) from error


def _reason(error: Exception) -> str:
    """Return why a port did not open, in words where the system's are long; others as pyserial has them."""
    known = {errno.ENOENT: "there is none of this name", errno.EISDIR: "it is a folder"}
    known[errno.EACCES] = "this user may not open it"
    code = getattr(error, "errno", None)
    if code is None and str(errno.ENOTTY) in str(error) and "configure port" in str(error):
        return "it is no serial port"
    return known.get(code or 0, str(error))


class PortLine:
    """A port as the line of a `LoadSession`: one that breaks is a `RequirementError`."""

    def __init__(self, port: "serial.Serial") -> None:
        self._port = port
        port.reset_input_buffer()  # replies to somebody before

    def write(self, octets: bytes) -> None:
        """Send octets."""
        try:
            self._port.write(octets)
        except OSError as error:
            raise _broken(error) from error

    def read(self, limit_s: float) -> bytes:
        """Return what comes first within this time, or within the port's own, which is not changed for each look."""
        try:
            octets: bytes = self._port.read(max(self._port.in_waiting, 1))
        except OSError as error:
            raise _broken(error) from error
        return octets

    def now(self) -> float:
        """Return the time in s, from any moment on."""
        return time.monotonic()


def _broken(error: OSError) -> RequirementError:
    return RequirementError(f"the port broke ({error}); a block that was not whole by then does not count")

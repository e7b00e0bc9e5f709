"""The median of readings without gaps."""

import numpy as np


def median(values: np.ndarray) -> float:
    """Return the median of one or more numbers, none of them NaN: NumPy's looks for those, at twice the time."""
    half = values.size // 2
    parted = np.partition(values, half)
    upper = float(parted[half])
    return upper if values.size % 2 else (float(parted[:half].max()) + upper) / 2

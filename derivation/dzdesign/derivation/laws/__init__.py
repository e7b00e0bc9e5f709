"""The compensation laws, one file each: the file's name is what `--law` takes, its `LAW` states the law.

A file put here is all that a new law takes: `dzdesign.derivation.law` finds it, and the other rooms ask there.
"""

import pkgutil

LAW_NAMES = tuple(module.name for module in pkgutil.iter_modules(__path__))

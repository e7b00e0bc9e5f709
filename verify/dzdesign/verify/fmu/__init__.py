"""FMUs in, and what is required of them out: valid, every input by the getters, the drive, V and MPa, closed loop.

FMPy reads and runs them, in a process of its own; nothing of the generator is used.
"""

"""FMUs in, and what is required of them out: files, descriptions, binaries, every input by the getters, closed loop.

Nothing of the generator is used: XML and binaries are read here, and the FMI functions called from C of this room, in
processes of their own.
"""

"""A folder of `--target matlab` in; its text read, every input of it tried in Octave and of its C compiled, out.

Nothing of the generator is used. The function runs in a process of its own, and only if it is what the manifest names
and of the subset that is read here, in which nothing but integers can be computed.
"""

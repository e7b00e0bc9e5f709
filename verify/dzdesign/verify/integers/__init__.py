"""A folder with Structured Text or for MATLAB in; the law of its text at every input against the exact one, out.

`text_values` evaluates the text's own assignments, `every_pair` tries any program at every input, and `exact_block`
says what it must give. Nothing here is of the generator: its own evaluation comes as a function from the front door.
"""

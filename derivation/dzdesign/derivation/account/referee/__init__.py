"""A referee of numbers: valves in plain floating point, at two pressure drops, on which every statement is tried.

In: statements with their scopes. Out: what each says wrong of a valve. It knows nothing of the account's formulas.
"""

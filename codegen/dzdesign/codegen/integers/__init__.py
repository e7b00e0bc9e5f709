"""A compensator in; its law as named integer operations, each with its exact range, and their text, out.

`interface` scales inputs and output, `law` traces the operations once, `form` proves them, and `text` prints them as
Structured Text and for MATLAB. Change the law in `law`: both texts follow, and `verify` evaluates what is printed.
"""
